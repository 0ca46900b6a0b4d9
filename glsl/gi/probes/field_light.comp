#version 460
#extension GL_GOOGLE_include_directive : require
// light_field.light: the radiance of the surface that each texel sees. A thread a texel.
layout(local_size_x = 8, local_size_y = 8) in;

#include "gi/shared/paths/bindings.glsl"

layout(set = 1, binding = 9) uniform utexture2D field_hits;
layout(set = 1, binding = 10, r32ui) uniform restrict writeonly uimage2D field_radiance;

#include "gi/probes/lookup_row.glsl"

layout(push_constant) uniform FieldLightParams {
    LookupRow lookup;
    uint edge;          // of a map [texels]
    uint columns;       // maps beside each other in the images
    uint probe_count;
} params;

#include "gi/shared/paths/path.glsl"
#define LOOKUP_BINDING 11
#define LOOKUP_CONSTANT 6
#define TRACES
#include "gi/probes/lookup.glsl"
#define REFLECTS_CONSTANT 12
#include "gi/probes/field_light.glsl"
