// Blocks of 4³ voxels as rays read them, a texel each: occupancy of the voxels in two words; number
// of the first one, or of an empty block the edge of the empty cube that it lies in (4, 8 or 16
// voxels; its corner is a multiple of the edge). A texel is read faster than words of a buffer.
#ifndef LUMIVOX_BLOCKS
#define LUMIVOX_BLOCKS

#include "gi/shared/voxel/grid.glsl"
#include "gi/shared/voxel/trace/space.glsl"

// The cell of a voxel of this block: the voxel, its empty eighth of the block or an empty cube.
SpaceCell cell_of_block(uvec3 block, uint bit) {
    uint word = bit < 32u ? block.x : block.y;
    int edge = (word >> (bit & 24u) & 255u) == 0u ? 2 : 1;
    if ((block.x | block.y) == 0u) edge = int(block.z);
    int slot = -1;
    if ((word >> (bit & 31u) & 1u) != 0u) slot = int(block.z + set_bits_below(block.xy, bit));
    return SpaceCell(edge, slot);
}

#endif
