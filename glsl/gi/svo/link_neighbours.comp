#version 460
#extension GL_GOOGLE_include_directive : require
// svo.link_neighbours: index + 1 of each tile's neighbour towards −x, −y and −z on its level, 0 where there is none; found by descent from the root.
// A thread a tile.
layout(local_size_x = 256) in;

#include "gi/svo/pool.glsl"

layout(std430, set = 1, binding = 0) restrict readonly buffer Levels { Level levels[]; };
layout(std430, set = 1, binding = 1) restrict readonly buffer Tiles { uint tiles[]; };
layout(std430, set = 1, binding = 2) restrict readonly buffer Nodes { uint nodes[]; };
layout(std430, set = 1, binding = 3) restrict writeonly buffer Neighbours { uint neighbours[]; };

layout(push_constant) uniform NeighbourParams {
    uint level;
    uint root;           // the coarsest level
    uint root_tile;
    uint first_place;    // tile whose place comes first in `tiles`
    uint first_linked;   // a neighbour before it in the pool counts for none
} params;

// Index + 1 of the tile at `position` of the level, or 0.
uint find_tile(uvec3 position) {
    if (any(greaterThanEqual(position, uvec3(1u << (params.root - params.level))))) return 0u;   // also below 0
    uint tile = params.root_tile;
    for (uint above = params.root - params.level; above > 0u; --above) {
        uint word = nodes[tile], node = child_index(position >> (above - 1u));
        if (!has_child(word, node)) return 0u;
        tile = child_of(word, node);
    }
    return tile < params.first_linked ? 0u : tile + 1u;
}

void main() {
    Level level = levels[params.level];
    uint index = linear_group(gl_WorkGroupID) * 256u + gl_LocalInvocationIndex;
    if (index >= level.count) return;
    uint tile = level.first + index;
    uvec3 position = unpack_tile(tiles[tile - params.first_place]);
    neighbours[3u * tile] = find_tile(position - uvec3(1u, 0u, 0u));
    neighbours[3u * tile + 1u] = find_tile(position - uvec3(0u, 1u, 0u));
    neighbours[3u * tile + 2u] = find_tile(position - uvec3(0u, 0u, 1u));
}
