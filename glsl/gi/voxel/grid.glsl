// The voxel grid: which voxels are occupied, and the compact index of each.
//
// Occupancy is one bit a voxel. 4×4×4 voxels are a block, two 32-bit words; a block's base is the number of occupied voxels in all blocks before it,
// so that the index of an occupied voxel is its block's base plus the set bits below its own. The order is that of the blocks: the same in every run.
#ifndef LUMIVOX_GRID
#define LUMIVOX_GRID

uint block_index(uvec3 voxel, uint resolution) {
    uvec3 block = voxel >> 2;
    uint blocks = resolution >> 2;
    return block.x + blocks * (block.y + blocks * block.z);
}

uint block_bit(uvec3 voxel) {
    uvec3 local = voxel & 3u;
    return local.x | local.y << 2 | local.z << 4;
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
