#version 460
#extension GL_GOOGLE_include_directive : require
// voxel.count_blocks: occupied voxels in each group of 1,024 blocks (four blocks a thread).
layout(local_size_x = 256) in;

#include "shared/prefix_sum.glsl"

layout(std430, set = 1, binding = 0) restrict readonly buffer Occupancy { uvec2 occupancy[]; };
layout(std430, set = 1, binding = 1) restrict writeonly buffer GroupSums { uint group_sums[]; };

layout(push_constant) uniform CountParams { uint block_count; } params;

void main() {
    uint count = 0u;
    for (uint i = 0u; i < 4u; ++i) {
        uint block = gl_GlobalInvocationID.x * 4u + i;
        if (block < params.block_count) count += uint(bitCount(occupancy[block].x) + bitCount(occupancy[block].y));
    }
    uint total;
    workgroup_prefix_sum(count, total);
    if (gl_LocalInvocationIndex == 0u) group_sums[gl_WorkGroupID.x] = total;
}
