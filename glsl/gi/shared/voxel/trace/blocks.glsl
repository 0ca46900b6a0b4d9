// Blocks of 4³ voxels as rays read them, a texel each: occupancy of the voxels in two words; number
// of the first one, or of an empty block the edge of the empty cube that it lies in (4, 8 or 16
// voxels; its corner is a multiple of the edge). A texel is read faster than words of a buffer.
#ifndef LUMIVOX_BLOCKS
#define LUMIVOX_BLOCKS

#include "gi/shared/voxel/grid.glsl"
#include "gi/shared/voxel/trace/space.glsl"

// The cell of a voxel of this block.
SpaceCell cell_of_block(uvec3 block, uint bit) {
    bool is_empty = (block.x | block.y) == 0u;
    int slot = -1;
    if (block_has(block.xy, bit)) slot = int(block.z + set_bits_below(block.xy, bit));
    return SpaceCell(is_empty ? int(block.z) : 1, slot);
}

#endif
