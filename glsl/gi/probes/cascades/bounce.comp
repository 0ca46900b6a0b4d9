#version 460
#extension GL_GOOGLE_include_directive : require
// cascades.bounce: the radiance that each ray brings of the light that probes have: what its hit
// reflects of it, diffusely. A thread a ray.
layout(local_size_x = 64) in;

#include "gi/shared/paths/bindings.glsl"

layout(set = 1, binding = 9) uniform texture2D ray_set;
layout(set = 1, binding = 10) uniform utexture2D ray_hits;
layout(set = 1, binding = 11, rgba32f) uniform restrict writeonly image2D ray_light;

#include "gi/probes/lookup_row.glsl"
#define LIST_BINDING 19
#include "gi/probes/list.glsl"

layout(push_constant) uniform LevelBounceParams {
    uint level_count;
    uint ray_count;      // of a probe
    uint first_probe;    // of the list
    uint all;            // rays
} params;

#define LOOKUP_BINDING 12
#define LOOKUP_CONSTANT 6
#include "gi/probes/cascades/lookup.glsl"
#include "gi/probes/bounce.glsl"
