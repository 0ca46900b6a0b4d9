#version 460
#extension GL_GOOGLE_include_directive : require
// clipmap.filter_top: one mip above the outermost level, from that level or the mip before. The level begins at a multiple of the coarsest mip's texel, so
// that texels modulo n and modulo n/2 keep together. A thread a texel.
layout(local_size_x = 4, local_size_y = 4, local_size_z = 4) in;

#include "gi/voxel/prefilter.glsl"

layout(constant_id = 0) const uint FILTER = 1;   // as `mode` of filter_eight

layout(set = 1, binding = 0, rgba16f) uniform restrict readonly image3D finer;
layout(set = 1, binding = 1, rgba16f) uniform restrict writeonly image3D coarser;

layout(push_constant) uniform TopParams { int finer_layer; } params;   // of `finer` that holds its layer 0

void main() {
    ivec3 texel = ivec3(gl_GlobalInvocationID);
    if (any(greaterThanEqual(texel, imageSize(coarser)))) return;
    vec4 c[8];
    for (int i = 0; i < 8; ++i) c[i] = imageLoad(finer, 2 * texel + ivec3(i & 1, i >> 1 & 1, i >> 2) + ivec3(0, 0, params.finer_layer));
    imageStore(coarser, texel, filter_eight(c, FILTER));
}
