#version 460
#extension GL_GOOGLE_include_directive : require
// svo.link_neighbours: index + 1 of each tile's neighbour towards +x, +y and +z on its level, 0 where there is none; found by descent from the root.
// Eight threads a tile, three of which work.
layout(local_size_x = 256) in;

#include "gi/svo/pool.glsl"

layout(std430, set = 1, binding = 0) restrict readonly buffer Levels { Level levels[]; };
layout(std430, set = 1, binding = 1) restrict readonly buffer Tiles { uint tiles[]; };
layout(std430, set = 1, binding = 2) restrict readonly buffer Nodes { uint nodes[]; };
layout(std430, set = 1, binding = 3) restrict writeonly buffer Neighbours { uint neighbours[]; };

layout(push_constant) uniform NeighbourParams { uint level; uint root; } params;

// Index + 1 of the tile at `position` of the level, or 0.
uint find_tile(uvec3 position) {
    if (any(greaterThanEqual(position, uvec3(1u << (params.root - params.level))))) return 0u;
    uint tile = 0u;
    for (uint above = params.root - params.level; above > 0u; --above) {
        uint node = nodes[8u * tile + child_index(position >> (above - 1u))];
        if (node == 0u) return 0u;
        tile = node & NODE_INDEX;
    }
    return tile + 1u;
}

void main() {
    Level level = levels[params.level];
    uint node = linear_group(gl_WorkGroupID) * 256u + gl_LocalInvocationIndex;
    uint axis = node & 7u;
    if (node >= 8u * level.count || axis >= 3u) return;
    uint tile = level.first + node / 8u;
    uvec3 position = unpack_tile(tiles[tile]);
    position[axis] += 1u;
    neighbours[3u * tile + axis] = find_tile(position);
}
