#version 460
#extension GL_GOOGLE_include_directive : require
// probes.trace: what each ray of each probe meets first. A thread a ray.
layout(local_size_x = 64) in;

#include "render/bvh/bindings.glsl"

layout(std430, set = 1, binding = 5) restrict readonly buffer ProbePlaces { vec4 probe_places[]; };
// x: triangle; y, z: where on it; w: distance [m], for tests
layout(set = 1, binding = 6) uniform texture2D ray_set;
layout(set = 1, binding = 7, rgba32ui) uniform restrict writeonly uimage2D ray_hits;

layout(push_constant) uniform TraceParams {
    uint ray_count;    // of a probe
    uint all;          // rays of all probes
} params;

#include "render/bvh/traverse.glsl"
#include "gi/probes/rays.glsl"

void main() {
    uint group = gl_WorkGroupID.x + gl_WorkGroupID.y * 65535u;
    uint ray = group * 64u + gl_LocalInvocationID.x;
    if (ray >= params.all) return;
    uint probe = ray / params.ray_count;
    vec3 direction = turn_of(probe) * ray_of_set(ray % params.ray_count);
    RayHit hit = closest_hit(probe_places[probe].xyz, direction, NO_TRIANGLE);
    imageStore(ray_hits, texel_of_ray(ray),
        uvec4(hit.triangle, floatBitsToUint(hit.at), floatBitsToUint(hit.t)));
}
