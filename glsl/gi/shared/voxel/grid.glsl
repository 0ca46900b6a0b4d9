// The voxel grid: which voxels are occupied, and the compact index of each.
//
// Occupancy is one bit a voxel. 4×4×4 voxels are a block, two 32-bit words; a block's base is the
// number of occupied voxels in all blocks before it, so that the index of an occupied voxel is its
// block's base plus the set bits below its own. The order is that of the blocks: the same in every
// run. Within a block it is Morton order, so that the voxels of a 2×2×2 have consecutive bits and
// indices.
#ifndef LUMIVOX_GRID
#define LUMIVOX_GRID

uint block_index(uvec3 voxel, uint resolution) {
    uvec3 block = voxel >> 2;
    uint blocks = resolution >> 2;
    return block.x + blocks * (block.y + blocks * block.z);
}

uint block_bit(uvec3 voxel) {
    uvec3 low = voxel & 1u, high = voxel >> 1 & 1u;
    return low.x | low.y << 1 | low.z << 2 | high.x << 3 | high.y << 4 | high.z << 5;
}

// Number of set bits of the block below `bit` (0 to 63).
uint set_bits_below(uvec2 words, uint bit) {
    uint below = bit < 32u ? 0u : uint(bitCount(words.x));
    uint word = bit < 32u ? words.x : words.y;
    return below + uint(bitCount(word & ((1u << (bit & 31u)) - 1u)));
}

bool block_has(uvec2 words, uint bit) {
    return (((bit < 32u ? words.x : words.y) >> (bit & 31u)) & 1u) != 0u;
}

#endif
