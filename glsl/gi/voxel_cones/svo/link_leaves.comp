#version 460
#extension GL_GOOGLE_include_directive : require
// svo.link_leaves: which nodes of a leaf tile are occupied voxels, and the compact index of the
// first. A thread 16 tiles of the level above; each of them has the leaf tiles of one block. Tiles
// of blocks outside of the given cube of the grid are left as they are.
layout(local_size_x = 64) in;

#include "gi/shared/voxel/grid.glsl"
#include "gi/voxel_cones/svo/pool.glsl"

layout(std430, set = 1, binding = 0) restrict readonly buffer Levels { Level levels[]; };
layout(std430, set = 1, binding = 1) restrict readonly buffer Tiles { uint tiles[]; };
layout(std430, set = 1, binding = 2) restrict readonly buffer Occupancy { uvec2 occupancy[]; };
layout(std430, set = 1, binding = 3) restrict readonly buffer BlockBases { uint block_bases[]; };
layout(std430, set = 1, binding = 4) restrict buffer Nodes { uint nodes[]; };

layout(push_constant) uniform LeafParams {
    uint blocks;         // along an edge of the cube
    uint first_x;        // its first block in the whole grid
    uint first_y;
    uint first_z;
    uint first_voxel;    // its first compact index
    uint first_place;    // tile whose place comes first in `tiles`
    uint first_child;    // leaf tiles before it in the pool are left as they are
} params;

void link(uint tile) {
    uvec3 block = unpack_tile(tiles[tile - params.first_place])
        - uvec3(params.first_x, params.first_y, params.first_z);
    if (any(greaterThanEqual(block, uvec3(params.blocks)))) return;   // also below 0
    uint index = block.x + params.blocks * (block.y + params.blocks * block.z), own = nodes[tile],
         leaf = own >> 8;
    if (leaf < params.first_child) return;
    uvec2 words = occupancy[index];
    uint voxel = params.first_voxel + block_bases[index];
    for (uint node = 0u; node < 8u; ++node) {
        if (has_child(own, node))
            nodes[leaf++] =
                voxel + set_bits_below(words, 8u * node) << 8 | tile_bits(words, 8u * node);
    }
}

void main() {
    Level level = levels[1];
    uint group = linear_group(gl_WorkGroupID);
    for (uint i = 0u; i < TILES_PER_THREAD; ++i) {
        uint index = TILES_PER_GROUP * group + 64u * i + gl_LocalInvocationIndex;
        if (index < level.count) link(level.first + index);
    }
}
