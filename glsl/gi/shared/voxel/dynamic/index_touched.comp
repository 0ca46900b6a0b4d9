#version 460
#extension GL_GOOGLE_include_directive : require
// voxel.index_touched: the list of touched blocks, with what they were; their occupancy by all
// geometry, and their places behind the static records.
layout(local_size_x = 256) in;

#include "shared/prefix_sum.glsl"
#include "gi/shared/voxel/dynamic/touched.glsl"
#include "gi/shared/voxel/dynamic/touched_box.glsl"

layout(std430, set = 1, binding = 0) restrict readonly buffer DynamicOccupancy {
    uvec2 dynamic_occupancy[];
};
layout(std430, set = 1, binding = 1) restrict readonly buffer TouchedSums { uvec2 touched_sums[]; };
layout(std430, set = 1, binding = 2) restrict buffer Occupancy { uvec2 occupancy[]; };
layout(std430, set = 1, binding = 3) restrict buffer BlockBases { uint block_bases[]; };
layout(std430, set = 1, binding = 4) restrict writeonly buffer TouchedBlocks {
    TouchedBlock touched[];
};
layout(std430, set = 1, binding = 5) restrict readonly buffer TouchedCounts {
    TouchedCounters counts;
};

uvec2 moving_words(uint index) {
    return index < box_block_count() ? dynamic_occupancy[box_block(index)] : uvec2(0u);
}

void main() {
    if (counts.indexed == 0u) return;
    uint first = gl_GlobalInvocationID.x * 4u, sum = 0u;
    for (uint i = 0u; i < 4u; ++i) {
        uvec2 words = moving_words(first + i);
        if ((words.x | words.y) != 0u)
            sum += BLOCK_UNIT + set_bits(words | occupancy[box_block(first + i)]);
    }
    uint total;
    uint before = workgroup_prefix_sum(sum, total);
    uvec2 place = touched_sums[gl_WorkGroupID.x] + uvec2(before / BLOCK_UNIT, before % BLOCK_UNIT);
    for (uint i = 0u; i < 4u; ++i) {
        uvec2 words = moving_words(first + i);
        if ((words.x | words.y) == 0u) continue;
        uint block = box_block(first + i);
        uvec2 still = occupancy[block];
        touched[place.x] = TouchedBlock(block, block_bases[block], still.x, still.y);
        occupancy[block] = still | words;
        block_bases[block] = params.first_slot + place.y;
        place += uvec2(1u, set_bits(still | words));
    }
}
