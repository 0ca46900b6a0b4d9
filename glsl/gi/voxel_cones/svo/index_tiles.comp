#version 460
#extension GL_GOOGLE_include_directive : require
// svo.index_tiles: the tile that a descent from the root comes to in each cell of a table, or the
// empty space that it ends in.
layout(local_size_x = 64) in;

#include "gi/voxel_cones/svo/pool.glsl"

layout(std430, set = 1, binding = 0) restrict readonly buffer Nodes { uint nodes[]; };
// a cell: a tile, or EMPTY_CELL + log2 of an empty node's edge [voxels]
layout(std430, set = 1, binding = 1) restrict writeonly buffer TopTiles { uint top_tiles[]; };

layout(push_constant) uniform IndexParams {
    uint cells;       // along an axis
    uint top_level;   // of the tiles in the table
    uint root;        // level of the root
} params;

void main() {
    uint index = gl_GlobalInvocationID.x + gl_GlobalInvocationID.y * 4194240u, n = params.cells;
    if (index >= n * n * n) return;
    uvec3 cell = uvec3(index % n, index / n % n, index / (n * n));
    uint tile = 0u;
    // A cell is a tile of the table's level, so a node of that above it.
    for (uint level = params.root; level > params.top_level; --level) {
        uint word = nodes[tile], node = child_index(cell >> (level - params.top_level - 1u));
        if (!has_child(word, node)) {
            top_tiles[index] = EMPTY_CELL + level;
            return;
        }
        tile = child_of(word, node);
    }
    top_tiles[index] = tile;
}
