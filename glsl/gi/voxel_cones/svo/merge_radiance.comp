#version 460
#extension GL_GOOGLE_include_directive : require
// svo.merge_radiance: the radiances of a piece's voxels among those of all, as texels, which no
// limit of a buffer bounds. A thread a radiance.
layout(local_size_x = 64) in;

#include "gi/voxel_cones/svo/cells.glsl"

layout(std430, set = 1, binding = 0) restrict readonly buffer PieceRadiance {
    uvec2 piece_radiance[];
};
layout(set = 1, binding = 1, rg32ui) uniform restrict writeonly uimage2D radiance_texels;

layout(push_constant) uniform MergeParams {
    uint first;   // radiance of the piece among all
    uint count;
} params;

void main() {
    uint index = gl_GlobalInvocationID.x + gl_GlobalInvocationID.y * 4194240u;
    if (index >= params.count) return;
    imageStore(radiance_texels, radiance_texel(params.first + index),
        uvec4(piece_radiance[index], 0u, 0u));
}
