// Which children of a dynamic tile are dynamic: where one of them is affected, all that there are,
// as they follow each other in the pool.
#ifndef LUMIVOX_DYNAMIC_CHILDREN
#define LUMIVOX_DYNAMIC_CHILDREN

#include "gi/shared/voxel/grid.glsl"
#include "gi/voxel_cones/svo/dynamic.glsl"
#include "gi/voxel_cones/svo/pool.glsl"

// The including pass declares `nodes`, `places`, `originals` and `affected_tiles`.
layout(push_constant) uniform DynamicParams {
    uint level;           // whose nodes get children
    uint first_dynamic;   // first tile behind the static ones
    uint capacity;        // dynamic tiles that there is room for, the entry too
    uint first_block;     // of the children's level in `affected_tiles`
    uint blocks;          // of that level along an axis
} params;

// Word of the static tile at the same place, or 0.
uint static_word(uint slot) {
    uint original = originals[slot];
    return original == 0u ? 0u : nodes[original - 1u];
}

// The nodes whose children are dynamic, given the word of the static tile.
uint dynamic_children(uint slot, uint word) {
    uvec3 first = 2u * unpack_tile(places[slot]);
    uint affected =
        tile_bits(affected_tiles[params.first_block + block_index(first, 4u * params.blocks)],
            block_bit(first));
    return affected == 0u ? 0u : affected | word & 255u;
}

#endif
