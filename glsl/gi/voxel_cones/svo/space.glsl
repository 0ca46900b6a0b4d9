// The space of gi/shared/voxel/trace/space.glsl as the octree: a table of its tiles of 16³ voxels,
// two levels of nodes, and blocks of 4³ voxels.
layout(constant_id = SPACE_CONSTANT) const uint SIDES = 1;   // radiances of a voxel: 1, 2, 6
// words from a surface to the next: 7 of a record, or 3 packed
layout(constant_id = SPACE_CONSTANT + 1) const uint SURFACE_WORDS = 7;

#include "gi/shared/voxel/grid.glsl"
#include "gi/voxel_cones/svo/pool.glsl"

layout(std430, set = 1, binding = SPACE_BINDING) restrict readonly buffer Nodes { uint nodes[]; };
// a cell: a tile, or EMPTY_CELL + log2 of an empty node's edge [voxels]
layout(std430, set = 1, binding = SPACE_BINDING + 1) restrict readonly buffer TopTiles {
    uint top_tiles[];
};
// three words a block: occupancy of its voxels, number of the first
layout(std430, set = 1, binding = SPACE_BINDING + 2) restrict readonly buffer Blocks {
    uint blocks[];
};
layout(std430, set = 1, binding = SPACE_BINDING + 3) restrict readonly buffer Surfaces {
    uint surfaces[];
};
layout(std430, set = 1, binding = SPACE_BINDING + 4) restrict readonly buffer VoxelRadiance {
    uvec2 voxel_radiance[];
};

#include "gi/shared/voxel/trace/radiance.glsl"

// Of a place in a tile of level 2 or 3: the child that it lies in; `is_there` stays true where
// there is one.
uint child_at(uint tile, ivec3 place, int level, inout bool is_there) {
    uint word = nodes[is_there ? tile : 0u], node = child_index(uvec3(place >> level));
    is_there = is_there && has_child(word, node);
    return child_of(word, node);
}

// By loads that do not wait for a loop: lanes of a software driver's vector wait for each other.
SpaceCell cell_around(ivec3 place) {
    uvec3 cell = uvec3(place >> 4);
    uint cells = max(params.resolution >> 4, 1u);
    uint tile = top_tiles[cell.x + cells * (cell.y + cells * cell.z)];
    bool is_there = tile < EMPTY_CELL;
    int edge = 1 << (is_there ? 3u : tile & 31u);
    // A grid of 8³ has no tile of level 3.
    if (params.resolution > 8u) tile = child_at(tile, place, 3, is_there);
    if (is_there) edge = 4;
    tile = child_at(tile, place, 2, is_there);
    // of tiles of level 1 that stand still: first, count; first of the others, whose blocks follow
    uvec3 tiles = params.space.xyz;
    uint block = tile - tiles.x;
    if (tiles.z != 0u && tile >= tiles.z) block = tile - tiles.z + tiles.y;
    uint at = is_there ? 3u * block : 0u;
    uvec2 words = uvec2(blocks[at], blocks[at + 1u]);
    uint bit = block_bit(uvec3(place));
    is_there = is_there && (words.x | words.y) != 0u;
    if (is_there) edge = 1;
    int slot = -1;
    if (is_there && block_has(words, bit)) slot = int(blocks[at + 2u] + set_bits_below(words, bit));
    return SpaceCell(edge, slot);
}

float voxel_edge(vec3 position) {
    return 1.0;
}

Voxel surface_of(uint slot) {
    uint at = slot * SURFACE_WORDS;
    Voxel voxel;
    if (SURFACE_WORDS == 3u) {
        voxel = unpack_surface(uvec3(surfaces[at], surfaces[at + 1u], surfaces[at + 2u]));
    } else {
        voxel.normal = surfaces[at + 2u];
        voxel.mean_position = surfaces[at + 4u];
        voxel.coverage = surfaces[at + 5u];
        voxel.across = surfaces[at + 6u];
    }
    return voxel;
}
