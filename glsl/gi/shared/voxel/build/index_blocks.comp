#version 460
#extension GL_GOOGLE_include_directive : require
// voxel.index_blocks: the compact index of each block's first occupied voxel (16 blocks a thread).
layout(local_size_x = 64) in;

#include "shared/prefix_sum.glsl"

layout(std430, set = 1, binding = 0) restrict readonly buffer Occupancy { uvec2 occupancy[]; };
layout(std430, set = 1, binding = 1) restrict readonly buffer GroupSums { uint group_sums[]; };
layout(std430, set = 1, binding = 2) restrict writeonly buffer BlockBases { uint block_bases[]; };

layout(push_constant) uniform CountParams { uint block_count; } params;

uint voxels_in(uint block) {
    return block < params.block_count
        ? uint(bitCount(occupancy[block].x) + bitCount(occupancy[block].y))
        : 0u;
}

void main() {
    uint group = gl_WorkGroupID.x + gl_WorkGroupID.y * 65535u,
         first = group * 1024u + gl_LocalInvocationIndex * 16u, count = 0u;
    for (uint i = 0u; i < 16u; ++i) count += voxels_in(first + i);
    uint total, base = workgroup_prefix_sum(count, total);
    if (first >= params.block_count) return;
    base += group_sums[group];
    for (uint i = 0u; i < 16u; ++i) {
        if (first + i < params.block_count) block_bases[first + i] = base;
        base += voxels_in(first + i);
    }
}
