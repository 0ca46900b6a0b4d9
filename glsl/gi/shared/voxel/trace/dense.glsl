// The space of gi/shared/voxel/trace/space.glsl as a dense grid: occupancy of its voxels, and the
// compact index of each. The including pass declares `occupancy`, `block_bases` and `params`, whose
// `resolution` is that of the grid.
#ifndef LUMIVOX_DENSE
#define LUMIVOX_DENSE

#include "gi/shared/voxel/grid.glsl"
#include "gi/shared/voxel/trace/space.glsl"

// Empty blocks are left as a whole.
SpaceCell cell_around(ivec3 place) {
    uint block = block_index(uvec3(place), params.resolution), bit = block_bit(uvec3(place));
    uvec2 words = occupancy[block];
    bool is_empty = (words.x | words.y) == 0u;
    int slot = -1;
    if (block_has(words, bit)) slot = int(block_bases[block] + set_bits_below(words, bit));
    return SpaceCell(is_empty ? 4 : 1, slot);
}

float voxel_edge(vec3 position) {
    return 1.0;
}

#endif
