#version 460
#extension GL_GOOGLE_include_directive : require
// probes.take: what rays of some probes bring that were cast through what another technique keeps.
// A thread a ray.
layout(local_size_x = 64) in;

#include "gi/shared/cast.glsl"

layout(std430, set = 1, binding = 0) restrict readonly buffer CastHits { CastHit cast_hits[]; };
layout(set = 1, binding = 1, rgba32ui) uniform restrict writeonly uimage2D ray_hits;
layout(set = 1, binding = 2, rgba32f) uniform restrict writeonly image2D ray_light;
#define LIST_BINDING 3
#include "gi/probes/list.glsl"

layout(push_constant) uniform RayParams {
    uint ray_count;      // of a probe
    uint first_probe;    // of the list
    uint all;            // rays
} params;

#include "gi/probes/ray_texel.glsl"

void main() {
    uint group = gl_WorkGroupID.x + gl_WorkGroupID.y * 65535u;
    uint index = group * 64u + gl_LocalInvocationID.x;
    if (index >= params.all) return;
    uint own = index % params.ray_count;
    uint probe = probe_list[params.first_probe + index / params.ray_count].x;
    vec4 light = cast_hits[index].light;
    imageStore(ray_light, texel_of_ray(index), vec4(light.rgb, isinf(light.w) ? 1.0 : 0.0));
    // How far it is alone: surfaces are the other technique's.
    imageStore(ray_hits, texel_of_ray(probe * params.ray_count + own),
        uvec4(0u, 0u, 0u, floatBitsToUint(light.w)));
}
