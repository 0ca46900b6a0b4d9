#version 460
#extension GL_GOOGLE_include_directive : require
// probes.surfaces: packs the surface that each ray of each probe has met where its hit was. A
// thread a ray.
layout(local_size_x = 64) in;

#include "render/bvh/bindings.glsl"

layout(constant_id = 3) const uint EMITTERS = 0;   // 0: nothing emits
layout(constant_id = 4) const uint BUMPS = 0;      // 1: some materials have normal maps

layout(set = 1, binding = 5) uniform texture2D ray_set;
layout(set = 1, binding = 6, rgba32ui) uniform restrict uimage2D ray_hits;

layout(push_constant) uniform TraceParams {
    uint ray_count;    // of a probe
    uint all;          // rays of all probes
} params;

#include "gi/probes/hit_surface.glsl"
#include "gi/probes/rays.glsl"

void main() {
    uint group = gl_WorkGroupID.x + gl_WorkGroupID.y * 65535u;
    uint ray = group * 64u + gl_LocalInvocationID.x;
    if (ray >= params.all) return;
    uvec4 hit = imageLoad(ray_hits, texel_of_ray(ray));
    if (hit.x == NO_TRIANGLE) return;
    vec3 direction = turn_of(ray / params.ray_count) * ray_of_set(ray % params.ray_count);
    PathVertex v = vertex_at(hit.x, uintBitsToFloat(hit.yz), -direction);
    imageStore(ray_hits, texel_of_ray(ray), pack_hit(hit.x, uintBitsToFloat(hit.w), v));
}
