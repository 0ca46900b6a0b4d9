#version 460
#extension GL_GOOGLE_include_directive : require
// voxel.count_blocks: occupied voxels in each group of 1,024 blocks (16 blocks a thread).
layout(local_size_x = 64) in;

layout(std430, set = 1, binding = 0) restrict readonly buffer Occupancy { uvec2 occupancy[]; };
layout(std430, set = 1, binding = 1) restrict writeonly buffer GroupSums { uint group_sums[]; };

layout(push_constant) uniform CountParams { uint block_count; } params;

shared uint total;

void main() {
    if (gl_LocalInvocationIndex == 0u) total = 0u;
    barrier();
    uint group = gl_WorkGroupID.x + gl_WorkGroupID.y * 65535u, count = 0u;
    for (uint i = 0u; i < 16u; ++i) {
        uint block = group * 1024u + i * 64u + gl_LocalInvocationIndex;
        if (block < params.block_count)
            count += uint(bitCount(occupancy[block].x) + bitCount(occupancy[block].y));
    }
    atomicAdd(total, count);
    barrier();
    if (gl_LocalInvocationIndex == 0u && group * 1024u < params.block_count)
        group_sums[group] = total;
}
