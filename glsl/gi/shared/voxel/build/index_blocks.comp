#version 460
#extension GL_GOOGLE_include_directive : require
// voxel.index_blocks: the compact index of each block's first occupied voxel (16 blocks a thread),
// and a list of the blocks that have any.
layout(local_size_x = 64) in;

layout(constant_id = 0) const uint LISTS = 0;   // 1: there is a list

#include "shared/prefix_sum.glsl"

layout(std430, set = 1, binding = 0) restrict readonly buffer Occupancy { uvec2 occupancy[]; };
layout(std430, set = 1, binding = 1) restrict readonly buffer GroupSums { uint group_sums[]; };
layout(std430, set = 1, binding = 2) restrict writeonly buffer BlockBases { uint block_bases[]; };

layout(std430, set = 1, binding = 3) restrict writeonly buffer FilledBlocks {
    uint filled_blocks[];
};
layout(std430, set = 1, binding = 4) restrict buffer Counters {
    uint fragment_count;
    uint voxel_count;
    uint unfinished_count;
    uint filled_count;
};

layout(push_constant) uniform CountParams { uint block_count; } params;

// A workgroup has up to 65,536 voxels; blocks are counted in the bits above.
const uint BLOCK_SHIFT = 17u;

shared uint first_filled;

uint voxels_in(uint block) {
    return block < params.block_count
        ? uint(bitCount(occupancy[block].x) + bitCount(occupancy[block].y))
        : 0u;
}

void main() {
    uint group = gl_WorkGroupID.x + gl_WorkGroupID.y * 65535u,
         first = group * 1024u + gl_LocalInvocationIndex * 16u, counts[16], sum = 0u;
    for (uint i = 0u; i < 16u; ++i) {
        counts[i] = voxels_in(first + i);
        sum += counts[i] | uint(counts[i] != 0u) << BLOCK_SHIFT;
    }
    uint total, before = workgroup_prefix_sum(sum, total), place = 0u;
    if (LISTS != 0u) {
        if (gl_LocalInvocationIndex == 0u)
            first_filled = atomicAdd(filled_count, total >> BLOCK_SHIFT);
        barrier();
        place = first_filled + (before >> BLOCK_SHIFT);
    }
    if (first >= params.block_count) return;
    uint base = group_sums[group] + (before & (1u << BLOCK_SHIFT) - 1u);
    for (uint i = 0u; i < 16u; ++i) {
        if (first + i < params.block_count) block_bases[first + i] = base;
        if (LISTS != 0u && counts[i] != 0u) filled_blocks[place++] = first + i;
        base += counts[i];
    }
}
