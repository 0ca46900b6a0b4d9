#version 460
#extension GL_GOOGLE_include_directive : require
// voxel.shift_blocks: the occupancy of a window after it has moved by whole blocks, as far as it
// stays where it was; the rest is empty. A thread a block.
layout(local_size_x = 64) in;

#include "gi/shared/voxel/window/window.glsl"

layout(std430, set = 1, binding = 0) restrict readonly buffer Occupancy { uvec2 occupancy[]; };
layout(std430, set = 1, binding = 1) restrict readonly buffer BlockBases { uint block_bases[]; };
layout(std430, set = 1, binding = 2) restrict writeonly buffer ShiftedOccupancy {
    uvec2 shifted_occupancy[];
};
// index of a block's first record before, or NEW_BLOCK
layout(std430, set = 1, binding = 3) restrict writeonly buffer MovedFrom { uint moved_from[]; };

layout(push_constant) uniform ShiftParams {
    int shift_x;   // that the window has moved by [blocks]
    int shift_y;
    int shift_z;
    int blocks;    // along an edge of the window
} params;

void main() {
    int block = int(gl_GlobalInvocationID.x);
    if (block >= params.blocks * params.blocks * params.blocks) return;
    ivec3 at = ivec3(block % params.blocks, block / params.blocks % params.blocks,
        block / (params.blocks * params.blocks));
    ivec3 before = at + ivec3(params.shift_x, params.shift_y, params.shift_z);
    bool stays =
        all(greaterThanEqual(before, ivec3(0))) && all(lessThan(before, ivec3(params.blocks)));
    int from = stays ? before.x + params.blocks * (before.y + params.blocks * before.z) : 0;
    shifted_occupancy[block] = stays ? occupancy[from] : uvec2(0u);
    moved_from[block] = stays ? block_bases[from] : NEW_BLOCK;
}
