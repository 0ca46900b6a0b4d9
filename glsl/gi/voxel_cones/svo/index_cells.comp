#version 460
#extension GL_GOOGLE_include_directive : require
// svo.index_cells: what rays read of the octree. A cell is 16³ voxels: which of its blocks of 4³
// hold voxels, a bit each in Morton order, and the number of the first of them; or the empty node
// that a descent from the root ends in. The blocks of a cell follow each other.
layout(local_size_x = 64) in;

#include "gi/voxel_cones/svo/cells.glsl"
#include "gi/voxel_cones/svo/pool.glsl"

layout(std430, set = 1, binding = 0) restrict readonly buffer Nodes { uint nodes[]; };
layout(set = 1, binding = 1, rgba32ui) uniform restrict writeonly uimage2D cells;
layout(set = 1, binding = 2, rgba32ui) uniform restrict writeonly uimage2D blocks;
layout(std430, set = 1, binding = 3) restrict buffer BlockCount { uint block_count; };

layout(push_constant) uniform IndexParams {
    uint edge;   // of the grid [cells]
    uint root;   // level of the root
} params;

// Level of tiles as large as a cell.
const uint CELL_LEVEL = 3u;

// A tile of level 1 as a block: 64 bits, and the number of the first voxel.
uvec3 block_of(uint tile) {
    uint word = nodes[tile], first_voxel = 0xffffffffu;
    uvec2 bits = uvec2(0u);
    for (uint node = 0u; node < 8u; ++node) {
        if (!has_child(word, node)) continue;
        uint leaf = nodes[child_of(word, node)], voxels = leaf & 255u;
        bits[node >> 2] |= voxels << 8u * (node & 3u);
        // Voxels of a block follow each other in this order.
        if (voxels != 0u) first_voxel = min(first_voxel, leaf >> 8);
    }
    return uvec3(bits, first_voxel);
}

// The tile of level 1 of block number `bit` of a tile of `level`, or −1.
int tile_of_block(uint tile, uint level, uint bit) {
    // Of a grid that is smaller than a cell, the tile is the first of a cell's larger nodes.
    if (level < CELL_LEVEL && bit >= 8u || level < 2u && bit >= 1u) return -1;
    for (uint above = level; above > 1u; --above) {
        uint word = nodes[tile], node = bit >> 3u * (above - 2u) & 7u;
        if (!has_child(word, node)) return -1;
        tile = child_of(word, node);
    }
    return int(tile);
}

void main() {
    uint index = gl_GlobalInvocationID.x + gl_GlobalInvocationID.y * 4194240u, n = params.edge;
    if (index >= n * n * n) return;
    uvec3 cell = uvec3(index % n, index / n % n, index / (n * n));
    uint tile = 0u, level = params.root;
    // A cell is a tile of its level, so a node of that above it.
    for (; level > CELL_LEVEL; --level) {
        uint word = nodes[tile], node = child_index(cell >> (level - CELL_LEVEL - 1u));
        if (!has_child(word, node)) {
            imageStore(cells, texel_of(index), uvec4(0u, 0u, 0u, level));
            return;
        }
        tile = child_of(word, node);
    }
    uvec2 bits = uvec2(0u);
    uint count = 0u;
    for (uint bit = 0u; bit < 64u; ++bit) {
        int of_block = tile_of_block(tile, level, bit);
        if (of_block < 0) continue;
        uvec3 block = block_of(uint(of_block));
        if ((block.x | block.y) == 0u) continue;
        bits[bit >> 5] |= 1u << (bit & 31u);
        ++count;
    }
    uint first = atomicAdd(block_count, count);
    imageStore(cells, texel_of(index), uvec4(bits, first, CELL_LEVEL + 1u));
    for (uint bit = 0u; bit < 64u; ++bit) {
        if ((bits[bit >> 5] >> (bit & 31u) & 1u) == 0u) continue;
        uvec3 block = block_of(uint(tile_of_block(tile, level, bit)));
        imageStore(blocks, texel_of(first), uvec4(block, 0u));
        ++first;
    }
}
