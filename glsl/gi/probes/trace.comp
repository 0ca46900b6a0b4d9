#version 460
#extension GL_GOOGLE_include_directive : require
// probes.trace: what each ray of some probes meets first. A thread a ray.
layout(local_size_x = 64) in;

#include "render/bvh/bindings.glsl"

layout(constant_id = 3) const uint KEEPS = 0;   // 1: what rays have met stays where nothing moved

// w: 1 where the probe stands elsewhere than when its rays were traced
layout(std430, set = 1, binding = 5) restrict readonly buffer ProbePlaces { vec4 probe_places[]; };
// x: triangle; y, z: where on it; w: distance [m], negative where that is a triangle, which is to
// be packed
layout(set = 1, binding = 6) uniform texture2D ray_set;
layout(set = 1, binding = 7, rgba32ui) uniform restrict uimage2D ray_hits;
#define LIST_BINDING 8
#include "gi/probes/list.glsl"

layout(push_constant) uniform TraceParams {
    vec4 low;            // xyz: the box in which something has moved [m]
    vec4 high;
    uint ray_count;      // of a probe
    uint first_probe;    // of the list
    uint all;            // rays
} params;

#include "render/bvh/traverse.glsl"
#include "gi/probes/rays.glsl"
#include "gi/probes/touches.glsl"

void main() {
    uint group = gl_WorkGroupID.x + gl_WorkGroupID.y * 65535u;
    uint index = group * 64u + gl_LocalInvocationID.x;
    if (index >= params.all) return;
    uvec2 probe = probe_list[params.first_probe + index / params.ray_count];
    uint own = index % params.ray_count;
    ivec2 texel = texel_of_ray(probe.x * params.ray_count + own);
    vec4 place = probe_places[probe.x];
    vec3 direction = turn_of(probe.y) * ray_of_set(own);
    if (KEEPS != 0u) {
        float distance = abs(uintBitsToFloat(imageLoad(ray_hits, texel).w));
        if (place.w == 0.0 && !touches_box(place.xyz, direction, distance)) return;
    }
    RayHit hit = closest_hit(place.xyz, direction, NO_TRIANGLE);
    float distance = hit.triangle == NO_TRIANGLE ? hit.t : -hit.t;
    imageStore(ray_hits, texel,
        uvec4(hit.triangle, floatBitsToUint(hit.at), floatBitsToUint(distance)));
}
