#version 460
#extension GL_GOOGLE_include_directive : require
// voxel_mips.list_groups: lists the groups of 4³ texels of a mip that hold one that may be other
// than zero: those that voxel_mips.filter makes. A thread a group.
layout(local_size_x = 64) in;

#include "gi/voxel_cones/matter.glsl"
#include "gi/voxel_cones/mips/groups.glsl"

layout(set = 1, binding = 0, r32ui) uniform restrict readonly uimage3D matter;
layout(std430, set = 1, binding = 1) restrict buffer FilterGroups { uint groups[]; };

layout(push_constant) uniform ListGroupsParams {
    int listed_mip;
    int resolution;      // texels along an edge of mip 0
    uint first_word;     // of the mip's list
    uint cubes;          // 1, or 6
} params;

// Texel i of a mip lies on the texels of stencil 2i of the next finer one: these bits of a word.
const uint EVEN = 0x0505u;

void main() {
    int size = params.resolution >> params.listed_mip, finer = 2 * size, along = group_row(size);
    int index = int(gl_GlobalInvocationID.x + gl_GlobalInvocationID.y * 4194240u);
    if (index >= along * along * along) return;
    ivec3 group = group_at(index, along);
    uint word = 0u;
    for (int i = 0; i < 16; ++i) {
        ivec3 stencil = 8 * group + ivec3(4, 4, 2) * ivec3(i & 1, i >> 1 & 1, i >> 2);
        if (any(greaterThanEqual(stencil, ivec3(finer)))) continue;
        word |= imageLoad(
            matter, matter_texel(stencil, params.resolution, params.listed_mip - 1)).r;
    }
    if ((word & EVEN) == 0u) return;
    uint head = params.first_word, at = atomicAdd(groups[head + 3u], 1u);
    groups[head + GROUP_HEAD + at] = uint(index);
    atomicMax(groups[head], min(at + 1u, GROUPS_ALONG));
    atomicMax(groups[head + 1u], at / GROUPS_ALONG + 1u);
    atomicMax(groups[head + 2u], params.cubes);
}
