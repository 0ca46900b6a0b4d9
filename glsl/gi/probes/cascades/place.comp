#version 460
#extension GL_GOOGLE_include_directive : require
// cascades.place: puts probes where they stand: away from what is too near, in some steps (Majercik
// et al. 2021, section 3). Those that stand already go where they would be put now, if something
// near them has moved. A workgroup a probe.
layout(local_size_x = 64) in;

#include "render/bvh/bindings.glsl"

layout(constant_id = 3) const uint KEEPS = 0;   // 1: the probes stand already

layout(std430, set = 1, binding = 5) restrict buffer ProbePlaces {
    vec4 probe_places[];
};
layout(set = 1, binding = 6) uniform texture2D ray_set;
#define LIST_BINDING 7
#include "gi/probes/list.glsl"
// of each of the list: xyz: place on the lattice [m]; w: spacing there [m]
layout(std430, set = 1, binding = 8) restrict readonly buffer ProbeHomes { vec4 probe_homes[]; };

layout(push_constant) uniform PlaceParams {
    vec4 low;            // xyz: the box in which something has moved [m]
    vec4 high;
    uint ray_count;      // of a probe
    uint first_probe;    // of the list
    uint probe_count;    // of those from there on
    float distance;      // that probes keep from surfaces [spacings]
} params;

#include "render/bvh/traverse.glsl"
#include "gi/probes/rays.glsl"

const uint THREADS = gl_WorkGroupSize.x, STEPS = 3u;

// Of all rays of a probe, a thread has so many.
const uint RAYS = 2u;

// A probe moves by at most so much [spacings].
const float FARTHEST = 0.45;

shared vec4 found[THREADS];    // of each thread: direction, and distance [m] or what is compared

// Of those of all threads, which are spread over the sphere: rays of near numbers go the same way.
uint ray_of_thread(uint i) {
    uint ray = gl_LocalInvocationID.x * RAYS + i;
    return ray * params.ray_count / (THREADS * RAYS);
}

void main() {
    uint index = gl_WorkGroupID.x + gl_WorkGroupID.y * 65535u;
    if (index >= params.probe_count) return;
    uvec2 row = probe_list[params.first_probe + index];
    uint thread = gl_LocalInvocationID.x;
    vec4 of_lattice = probe_homes[params.first_probe + index];
    vec3 home = of_lattice.xyz, place = home;
    float spacing = of_lattice.w, keep_m = params.distance * spacing;
    vec3 before = KEEPS != 0u ? probe_places[row.x].xyz : vec3(0.0);
    // What is nearer than this has to do with where it stands: itself, and room to the other side.
    float near_m = FARTHEST * spacing + 2.0 * keep_m;
    bool is_near = all(greaterThan(params.high.xyz, home - near_m))
        && all(lessThan(params.low.xyz, home + near_m));
    if (KEEPS != 0u && !is_near) {
        if (thread == 0u) probe_places[row.x] = vec4(before, 0.0);
        return;
    }
    mat3 turn = turn_of(row.y);
    for (uint step = 0u; step < STEPS && keep_m > 0.0; ++step) {
        vec4 nearest = vec4(0.0, 0.0, 0.0, uintBitsToFloat(0x7f800000u));
        for (uint i = 0u; i < RAYS; ++i) {
            vec3 direction = turn * ray_of_set(ray_of_thread(i));
            float t = closest_hit(place, direction, NO_TRIANGLE).t;
            if (t < nearest.w) nearest = vec4(direction, t);
        }
        barrier();
        found[thread] = nearest;
        barrier();
        for (uint i = 0u; i < THREADS; ++i)
            if (found[i].w < nearest.w) nearest = found[i];
        if (nearest.w >= keep_m) break;
        // The ray that goes the other way.
        vec4 opposite = vec4(0.0, 0.0, 0.0, -2.0);
        for (uint i = 0u; i < RAYS; ++i) {
            vec3 direction = turn * ray_of_set(ray_of_thread(i));
            float behind = -dot(direction, nearest.xyz);
            if (behind > opposite.w) opposite = vec4(direction, behind);
        }
        barrier();
        found[thread] = opposite;
        barrier();
        for (uint i = 0u; i < THREADS; ++i)
            if (found[i].w > opposite.w) opposite = found[i];
        float far = closest_hit(place, opposite.xyz, NO_TRIANGLE).t;
        float room = 0.5 * max(far - nearest.w, 0.0);
        vec3 way = place - min(keep_m - nearest.w, room) * nearest.xyz - home;
        float farthest = FARTHEST * spacing;
        place = home + way * min(1.0, farthest / max(length(way), 1e-30));
    }
    bool has_moved = KEEPS != 0u && place != before;
    if (thread == 0u) probe_places[row.x] = vec4(place, has_moved ? 1.0 : 0.0);
}
