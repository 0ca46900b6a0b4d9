#version 460
#extension GL_GOOGLE_include_directive : require
// light_field.gather: indirect diffuse irradiance, E = π / n Σ L_i over cosine-distributed
// directions, and the share of them that meets nothing.
layout(local_size_x = 8, local_size_y = 8) in;

#include "gi/shared/paths/bindings.glsl"

layout(set = 1, binding = 9) uniform texture2D view_depth;
layout(set = 1, binding = 10) uniform utexture2D normals;
layout(set = 1, binding = 11, rgba32f) uniform restrict image2D indirect_diffuse;

#include "gi/probes/light_field/params.glsl"

#include "shared/receiver.glsl"
#include "gi/shared/paths/path.glsl"
#define FIELD_BINDING 12
#define FIELD_CONSTANT 6
#include "gi/probes/light_field/rays.glsl"

const float GOLDEN_ANGLE = 2.399963229728653;

void main() {
    ivec2 texel = ivec2(gl_GlobalInvocationID.xy);
    if (!is_gathered(texel)) return;
    Surface surface;
    if (!read_receiver(texel, surface)) {
        imageStore(indirect_diffuse, texel, vec4(0.0));
        return;
    }
    FieldStart start = field_start(surface);
    mat3 around = frame_around(surface.shading_normal);
    vec2 offset = offset_of(place_of(texel));
    vec4 sum = vec4(0.0);
    for (uint i = params.first_ray; i < params.end_ray; ++i) {
        float u = (float(i) + offset.x) / float(params.ray_count);
        vec3 direction =
            hemisphere_direction(around, u, float(i) * GOLDEN_ANGLE + offset.y * 2.0 * PI);
        // What a bent normal lets below the surface is the surface's own.
        if (dot(direction, surface.geometric_normal) <= 0.0) continue;
        float density = dot(direction, surface.shading_normal) / PI;
        sum += light_along_field(surface, start, direction, density) * vec4(vec3(PI), 1.0);
    }
    vec4 before = params.first_ray == 0u ? vec4(0.0) : imageLoad(indirect_diffuse, texel);
    imageStore(indirect_diffuse, texel, before + sum / float(params.ray_count));
}
