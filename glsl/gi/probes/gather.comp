#version 460
#extension GL_GOOGLE_include_directive : require
// probes.gather: irradiance and ambient visibility from the eight probes around each surface. A
// thread a pixel.
layout(local_size_x = 8, local_size_y = 8) in;

#ifdef TRACES
#include "render/bvh/bindings.glsl"
#define FIRST_BINDING 5
#define LOOKUP_CONSTANT 3
#else
#define FIRST_BINDING 0
#define LOOKUP_CONSTANT 0
#endif

layout(set = 1, binding = FIRST_BINDING) uniform texture2D view_depth;
layout(set = 1, binding = FIRST_BINDING + 1) uniform utexture2D normals;
layout(set = 1, binding = FIRST_BINDING + 2, rgba32f) uniform restrict writeonly image2D
    indirect_diffuse;

// pixels that see none of the eight probes around them
layout(std430, set = 1, binding = FIRST_BINDING + 8) restrict buffer ProbeOrphans {
    uint probe_orphans;
};

#include "gi/probes/lookup_row.glsl"

layout(push_constant) uniform LookupParams {
    LookupRow lookup;
} params;

#include "shared/receiver.glsl"
#ifdef TRACES
#include "render/bvh/traverse.glsl"
#endif
#define LOOKUP_BINDING FIRST_BINDING + 3
#include "gi/probes/lookup.glsl"
#include "gi/probes/gather.glsl"
