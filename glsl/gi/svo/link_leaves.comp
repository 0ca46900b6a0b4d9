#version 460
#extension GL_GOOGLE_include_directive : require
// svo.link_leaves: which nodes of a leaf tile are occupied voxels, and the compact index of the first. A thread a tile.
layout(local_size_x = 256) in;

#include "gi/voxel/grid.glsl"
#include "gi/svo/pool.glsl"

layout(std430, set = 1, binding = 0) restrict readonly buffer Levels { Level levels[]; };
layout(std430, set = 1, binding = 1) restrict readonly buffer Tiles { uint tiles[]; };
layout(std430, set = 1, binding = 2) restrict readonly buffer Occupancy { uvec2 occupancy[]; };
layout(std430, set = 1, binding = 3) restrict readonly buffer BlockBases { uint block_bases[]; };
layout(std430, set = 1, binding = 4) restrict writeonly buffer Nodes { uint nodes[]; };

layout(push_constant) uniform LeafParams { uint resolution; uint first_place; } params;   // first_place: tile whose place comes first

void main() {
    Level level = levels[0];
    uint index = linear_group(gl_WorkGroupID) * 256u + gl_LocalInvocationIndex;
    if (index >= level.count) return;
    uint tile = level.first + index;
    // The voxels of a tile lie in one block.
    uvec3 first = 2u * unpack_tile(tiles[tile - params.first_place]);
    uint block = block_index(first, params.resolution);
    uvec2 words = occupancy[block];
    uint bit = block_bit(first);
    nodes[tile] = block_bases[block] + set_bits_below(words, bit) << 8 | tile_bits(words, bit);
}
