#version 460
#extension GL_GOOGLE_include_directive : require
// cascades.gather: irradiance and ambient visibility from the probes around each surface. A thread
// a pixel.
layout(local_size_x = 8, local_size_y = 8) in;

#define LOOKUP_CONSTANT 0

layout(set = 1, binding = 0) uniform texture2D view_depth;
layout(set = 1, binding = 1) uniform utexture2D normals;
layout(set = 1, binding = 2, rgba32f) uniform restrict writeonly image2D indirect_diffuse;

// pixels that see none of the eight probes around them of any level
layout(std430, set = 1, binding = 10) restrict buffer ProbeOrphans {
    uint probe_orphans;
};

#include "gi/probes/lookup_row.glsl"

layout(push_constant) uniform LevelParams {
    uint level_count;
} params;

#include "shared/receiver.glsl"
#define LOOKUP_BINDING 3
#include "gi/probes/cascades/lookup.glsl"
#include "gi/probes/gather.glsl"
