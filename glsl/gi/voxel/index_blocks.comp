#version 460
#extension GL_GOOGLE_include_directive : require
// voxel.index_blocks: the compact index of each block's first occupied voxel.
layout(local_size_x = 256) in;

#include "shared/prefix_sum.glsl"

layout(std430, set = 1, binding = 0) restrict readonly buffer Occupancy { uvec2 occupancy[]; };
layout(std430, set = 1, binding = 1) restrict readonly buffer GroupSums { uint group_sums[]; };
layout(std430, set = 1, binding = 2) restrict writeonly buffer BlockBases { uint block_bases[]; };

layout(push_constant) uniform CountParams { uint block_count; } params;

void main() {
    uint first = gl_GlobalInvocationID.x * 4u;
    uint counts[4];
    uint count = 0u;
    for (uint i = 0u; i < 4u; ++i) {
        counts[i] = first + i < params.block_count ? uint(bitCount(occupancy[first + i].x) + bitCount(occupancy[first + i].y)) : 0u;
        count += counts[i];
    }
    uint total;
    uint base = group_sums[gl_WorkGroupID.x] + workgroup_prefix_sum(count, total);
    for (uint i = 0u; i < 4u; ++i) {
        if (first + i < params.block_count) block_bases[first + i] = base;
        base += counts[i];
    }
}
