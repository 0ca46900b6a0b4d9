#version 460
#extension GL_GOOGLE_include_directive : require
// probes.surfaces: packs the surface that each ray of some probes has met where its hit was, if it
// was traced since. A thread a ray.
layout(local_size_x = 64) in;

#include "render/bvh/bindings.glsl"

layout(constant_id = 3) const uint EMITTERS = 0;   // 0: nothing emits
layout(constant_id = 4) const uint BUMPS = 0;      // 1: some materials have normal maps

layout(set = 1, binding = 5) uniform texture2D ray_set;
layout(set = 1, binding = 6, rgba32ui) uniform restrict uimage2D ray_hits;
#define LIST_BINDING 7
#include "gi/probes/list.glsl"

layout(push_constant) uniform RayParams {
    uint ray_count;      // of a probe
    uint first_probe;    // of the list
    uint all;            // rays
} params;

#include "gi/probes/hit_surface.glsl"
#include "gi/probes/rays.glsl"

void main() {
    uint group = gl_WorkGroupID.x + gl_WorkGroupID.y * 65535u;
    uint index = group * 64u + gl_LocalInvocationID.x;
    if (index >= params.all) return;
    uvec2 probe = probe_list[params.first_probe + index / params.ray_count];
    uint own = index % params.ray_count;
    ivec2 texel = texel_of_ray(probe.x * params.ray_count + own);
    uvec4 hit = imageLoad(ray_hits, texel);
    bool is_packed = (hit.w & 0x80000000u) == 0u;
    if (is_packed) return;
    vec3 direction = turn_of(probe.y) * ray_of_set(own);
    PathVertex v = vertex_at(hit.x, uintBitsToFloat(hit.yz), -direction);
    imageStore(ray_hits, texel, pack_hit(hit.x, -uintBitsToFloat(hit.w), v));
}
