#version 460
#extension GL_GOOGLE_include_directive : require
// probes.bounce: the radiance that each ray brings of the light that probes have: what its hit
// reflects of it, diffusely. A thread a ray.
layout(local_size_x = 64) in;

#include "gi/shared/paths/bindings.glsl"

layout(set = 1, binding = 9) uniform texture2D ray_set;
layout(set = 1, binding = 10) uniform utexture2D ray_hits;
layout(set = 1, binding = 11, rgba32f) uniform restrict writeonly image2D ray_light;

#include "gi/probes/lookup_row.glsl"
#define LIST_BINDING 17
#include "gi/probes/list.glsl"

layout(push_constant) uniform BounceParams {
    LookupRow lookup;
    uint ray_count;      // of a probe
    uint first_probe;    // of the list
    uint all;            // rays
} params;

#include "gi/probes/hit_surface.glsl"
#define LOOKUP_BINDING 12
#define LOOKUP_CONSTANT 6
#define TRACES
#include "gi/probes/lookup.glsl"
#include "gi/probes/bounce.glsl"
