#version 460
#extension GL_GOOGLE_include_directive : require
// voxel.count_touched: the blocks that dynamic geometry touches, and the voxels in them, in each
// group of 1,024 blocks of its box (four blocks a thread).
layout(local_size_x = 256) in;

#include "shared/prefix_sum.glsl"
#include "gi/shared/voxel/dynamic/touched.glsl"
#include "gi/shared/voxel/dynamic/touched_box.glsl"

layout(std430, set = 1, binding = 0) restrict readonly buffer Occupancy { uvec2 occupancy[]; };
layout(std430, set = 1, binding = 1) restrict readonly buffer DynamicOccupancy {
    uvec2 dynamic_occupancy[];
};
// blocks, voxels
layout(std430, set = 1, binding = 2) restrict writeonly buffer TouchedSums {
    uvec2 touched_sums[];
};
layout(std430, set = 1, binding = 3) restrict buffer TouchedCounts { TouchedCounters counts; };

void main() {
    uint sum = 0u, added = 0u, moving = 0u;
    for (uint i = 0u; i < 4u; ++i) {
        uint index = gl_GlobalInvocationID.x * 4u + i;
        if (index >= box_block_count()) continue;
        uint block = box_block(index);
        uvec2 words = dynamic_occupancy[block];
        if ((words.x | words.y) == 0u) continue;
        uvec2 all = words | occupancy[block];
        sum += BLOCK_UNIT + set_bits(all);
        added += set_bits(words & ~occupancy[block]);
        moving += set_bits(words);
    }
    if (moving != 0u) {
        atomicAdd(counts.added_voxels, added);
        atomicAdd(counts.dynamic_voxels, moving);
    }
    uint total;
    workgroup_prefix_sum(sum, total);
    if (gl_LocalInvocationIndex == 0u)
        touched_sums[gl_WorkGroupID.x] = uvec2(total / BLOCK_UNIT, total % BLOCK_UNIT);
}
