#version 460
#extension GL_GOOGLE_include_directive : require
// ray_traced.gather: indirect diffuse irradiance, E = π / n Σ L_i over cosine-distributed
// directions, each of which begins a path; and the share of them that meets nothing.
layout(local_size_x = 8, local_size_y = 8) in;

#include "gi/shared/paths/bindings.glsl"

layout(set = 1, binding = 9) uniform texture2D view_depth;
layout(set = 1, binding = 10) uniform utexture2D normals;
layout(set = 1, binding = 11, rgba32f) uniform restrict image2D indirect_diffuse;

#include "gi/ray_traced/params.glsl"

#include "shared/receiver.glsl"
#define SPACE_BINDING 12
#include "gi/shared/paths/path.glsl"
#include "gi/shared/paths/start.glsl"

const float GOLDEN_ANGLE = 2.399963229728653;

void main() {
    ivec2 texel = ivec2(gl_GlobalInvocationID.xy);
    if (!is_gathered(texel)) return;
    Surface surface;
    if (!read_receiver(texel, surface)) {
        imageStore(indirect_diffuse, texel, vec4(0.0));
        return;
    }
    ivec2 place = place_of(texel);
    vec3 to_eye = normalize(frame.eye_ws.xyz - surface.position_ws);
    PathVertex start =
        first_vertex(surface, to_eye, vec3(1.0), vec3(0.0), -1.0);
    mat3 around = frame_around(surface.shading_normal);
    // Without a pattern each pixel begins anywhere.
    bool is_alone = (params.pattern & 0xffffu) == 0x101u;
    vec2 offset = is_alone ? unit_numbers(pcg3(uvec3(place, frame.walk.x))).xy
                           : interleaved_offset(place, params.pattern, frame.walk.x);
    vec4 sum = vec4(0.0);
    for (uint i = params.first_ray; i < params.end_ray; ++i) {
        float u = (float(i) + offset.x) / float(params.ray_count);
        vec3 direction =
            hemisphere_direction(around, u, float(i) * GOLDEN_ANGLE + offset.y * 2.0 * PI);
        bool escaped;
        uvec2 which = uvec2(frame.walk.x * params.ray_count + i, params.ray_count);
        vec3 light = light_along(start, direction, place, which, params.bounces,
            params.hit_roughness, escaped);
        sum += vec4(PI * light, escaped ? 1.0 : 0.0);
    }
    vec4 before = params.first_ray == 0u ? vec4(0.0) : imageLoad(indirect_diffuse, texel);
    imageStore(indirect_diffuse, texel, before + sum / float(params.ray_count));
}
