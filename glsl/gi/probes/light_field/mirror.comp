#version 460
#extension GL_GOOGLE_include_directive : require
// light_field.mirror: indirect specular radiance L_s of glossy surfaces, along directions of the
// lobe's visible normals.
layout(local_size_x = 8, local_size_y = 8) in;

#include "gi/shared/paths/bindings.glsl"

layout(set = 1, binding = 9) uniform texture2D view_depth;
layout(set = 1, binding = 10) uniform utexture2D normals;
layout(set = 1, binding = 11) uniform texture2D specular;
layout(set = 1, binding = 12, rgba32f) uniform restrict image2D indirect_specular;

#include "gi/probes/light_field/params.glsl"

#include "shared/gbuffer.glsl"
#include "gi/shared/paths/path.glsl"
#define FIELD_BINDING 13
#define FIELD_CONSTANT 6
#include "gi/probes/light_field/rays.glsl"

// 1: only what reflections of probes have left
layout(constant_id = 16) const uint MIRRORS_LEFT = 0;

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, ivec2(frame.size_px.xy)))) return;
    float mark = 0.0;
    if (MIRRORS_LEFT != 0u) {
        mark = imageLoad(indirect_specular, pixel).a;
        if (mark == 0.0) return;
    }
    Surface surface;
    vec4 lobe = texelFetch(sampler2D(specular, nearest_clamp), pixel, 0);
    if (!read_surface(pixel, surface) || lobe.a < 0.0) {
        imageStore(indirect_specular, pixel, vec4(0.0));
        return;
    }
    vec3 to_eye = normalize(frame.eye_ws.xyz - surface.position_ws);
    PathVertex glossy = first_vertex(surface, to_eye, vec3(0.0), lobe.rgb, lobe.a);
    FieldStart start = field_start(surface);
    vec2 offset = offset_of(pixel);
    vec3 sum = vec3(0.0);
    for (uint i = params.first_ray; i < params.end_ray; ++i) {
        // The R2 sequence (Roberts 2018), from where the pixel is in its tile.
        vec2 random = fract(offset + float(i) * vec2(0.7548776662466927, 0.5698402909980532));
        vec3 direction = lobe_direction(glossy, random);
        vec4 reflected = reflected_towards(glossy, direction);
        if (reflected.rgb == vec3(0.0) || !(reflected.a > 0.0)) continue;
        sum += reflected.rgb / reflected.a
            * light_along_field(surface, start, direction, reflected.a).rgb;
    }
    vec3 before =
        params.first_ray == 0u ? vec3(0.0) : imageLoad(indirect_specular, pixel).rgb;
    imageStore(indirect_specular, pixel, vec4(before + sum / float(params.ray_count), mark));
}
