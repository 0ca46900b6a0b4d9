// Leaves made of the voxels' records, which are bound piece by piece of the grid.
#ifndef LUMIVOX_PIECES
#define LUMIVOX_PIECES

layout(push_constant) uniform RecordParams {
    uint first;         // static tile of the level
    uint count;
    uint first_dynamic;
    uint dynamic_count;
    uint level;
    uint first_voxel;   // of the piece
    uint voxel_count;
} params;

uint brick_of(uint tile, uint face) {
    return tile;
}

// The voxels of a tile lie in one block, and so in one piece; one without voxels is of all.
bool is_of_piece(uint tile) {
    // also below 0
    return (tile & 255u) == 0u || (tile >> 8) - params.first_voxel < params.voxel_count;
}

#endif
