// The box of blocks that dynamic geometry can touch.
#ifndef LUMIVOX_TOUCHED_BOX
#define LUMIVOX_TOUCHED_BOX

layout(push_constant) uniform TouchedParams {
    uint first_x;             // first block
    uint first_y;
    uint first_z;
    uint size_x;              // blocks along each axis
    uint size_y;
    uint size_z;
    uint blocks;              // of the grid, along an axis
    uint first_slot;          // number of static records
} params;

uint box_block_count() {
    return params.size_x * params.size_y * params.size_z;
}

// Index in the grid of a block of the box.
uint box_block(uint index) {
    uint row = index / params.size_x;
    uvec3 at = uvec3(index % params.size_x + params.first_x, row % params.size_y + params.first_y,
        row / params.size_y + params.first_z);
    return at.x + params.blocks * (at.y + params.blocks * at.z);
}

uint set_bits(uvec2 words) {
    return uint(bitCount(words.x) + bitCount(words.y));
}

// Touched blocks (from bit 17 on) and their voxels, in one sum over the 1,024 blocks of a
// workgroup.
const uint BLOCK_UNIT = 1u << 17;

#endif
