#version 460
#extension GL_GOOGLE_include_directive : require
// cascades.mirror: indirect specular radiance L_s of glossy surfaces, by rays along directions of
// the lobe's visible normals. What they hit has the lights' light, and that of probes.
layout(local_size_x = 8, local_size_y = 8) in;

#include "gi/shared/paths/bindings.glsl"

layout(set = 1, binding = 9) uniform texture2D view_depth;
layout(set = 1, binding = 10) uniform utexture2D normals;
layout(set = 1, binding = 11) uniform texture2D specular;
layout(set = 1, binding = 12, rgba32f) uniform restrict image2D indirect_specular;

#include "gi/probes/lookup_row.glsl"

layout(push_constant) uniform LevelMirrorParams {
    uint level_count;
    uint ray_count;      // of all dispatches
    uint first_ray;      // of this dispatch, which adds to what those before it left
    uint end_ray;
    uint pattern;        // of a tile of pixels, each of which has directions of its own
    uint has_light;      // 1: what rays hit reflects the light of probes too
} params;

// 1: only what reflections of probes have left
layout(constant_id = 12) const uint MIRRORS_LEFT = 0;

#define LEFT MIRRORS_LEFT
#define BEYOND
#define MIRROR_BOUNCES 1u
#include "gi/shared/paths/mirror.glsl"
#define LOOKUP_BINDING 13
#define LOOKUP_CONSTANT 6
#include "gi/probes/cascades/lookup.glsl"
#include "gi/probes/beyond.glsl"
