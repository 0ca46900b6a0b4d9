#version 460
#extension GL_GOOGLE_include_directive : require
// cascades.light_field: the radiance of the surface that each texel of reflection probes sees. What
// further bounces bring there is looked up in the levels. A thread a texel.
layout(local_size_x = 8, local_size_y = 8) in;

#include "gi/shared/paths/bindings.glsl"

layout(set = 1, binding = 9) uniform utexture2D field_hits;
layout(set = 1, binding = 10, r32ui) uniform restrict writeonly uimage2D field_radiance;

#include "gi/probes/lookup_row.glsl"

layout(push_constant) uniform LevelFieldParams {
    uint level_count;
    uint edge;          // of a map [texels]
    uint columns;       // maps beside each other in the images
    uint probe_count;   // of reflection probes
} params;

#include "gi/shared/paths/path.glsl"
#define LOOKUP_BINDING 11
#define LOOKUP_CONSTANT 6
#include "gi/probes/cascades/lookup.glsl"
#define REFLECTS_CONSTANT 12
#include "gi/probes/field_light.glsl"
