#version 460
#extension GL_GOOGLE_include_directive : require
// svo.reduce_points: which points of the next coarser lattice, and which tiles of this level, have something to hold.
//
// Point q of the coarser lattice is made of the finer ones 2q and 2q + 1 (of corners: 2q − 1 to 2q + 1), tile T holds the points 2T to 2T + 2: each is
// there where any of those is. So a texel that is not zero has a brick in every tile that it borders on. A thread makes 4×4×4 points and tiles.
layout(local_size_x = 64) in;

layout(std430, set = 1, binding = 0) restrict readonly buffer FinerPoints { uvec2 finer_points[]; };
layout(std430, set = 1, binding = 1) restrict writeonly buffer CoarserPoints { uvec2 coarser_points[]; };
layout(std430, set = 1, binding = 2) restrict writeonly buffer TileBits { uvec2 level_tiles[]; };
layout(std430, set = 1, binding = 3) restrict buffer TileCounts { uint tile_counts[]; };

#include "gi/svo/pool.glsl"

layout(push_constant) uniform ReduceParams {
    uint finer_blocks;     // along an axis, as are the next two
    uint coarser_blocks;
    uint tile_limit;
    uint level;
    int point_reach;       // how far below 2q a coarser point reaches, along each axis
    int tile_reach;        // likewise a tile below 2T: 1 where the finer bits are voxels that spread to the points v and v + 1
} params;

uint range_bits(int low, int high) {
    return ((2u << min(high, 3)) - 1u) & ~((1u << max(low, 0)) - 1u);
}

// The bits of a block (gi/voxel/grid.glsl) in a box: along each axis the planes 0 to 3, as far as they are in it.
uvec2 box_bits(ivec3 low, ivec3 high) {
    uint x = range_bits(low.x, high.x), y = range_bits(low.y, high.y), z = range_bits(low.z, high.z);
    uint along_x = (x & 1u) * 0x00550055u | (x >> 1 & 1u) * 0x00aa00aau | (x >> 2 & 1u) * 0x55005500u | (x >> 3) * 0xaa00aa00u;
    uint along_y = (y & 1u) * 0x00003333u | (y >> 1 & 1u) * 0x0000ccccu | (y >> 2 & 1u) * 0x33330000u | (y >> 3) * 0xcccc0000u;
    uvec2 along_z = uvec2(z & 1u, z >> 2 & 1u) * 0x0f0f0f0fu | uvec2(z >> 1 & 1u, z >> 3) * 0xf0f0f0f0u;
    return along_z & (along_x & along_y);
}

uvec2 finer_block(ivec3 block) {
    return finer_points[uint(block.x) + params.finer_blocks * (uint(block.y) + params.finer_blocks * uint(block.z))];
}

// Whether there is a finer point between the two corners, which belong to it.
bool any_point(ivec3 low, ivec3 high) {
    ivec3 first = max(low, ivec3(0)) >> 2, last = min(high >> 2, ivec3(params.finer_blocks) - 1);
    uvec2 found = uvec2(0u);
    for (int z = first.z; z <= last.z; ++z) {
        for (int y = first.y; y <= last.y; ++y) {
            for (int x = first.x; x <= last.x; ++x) {
                ivec3 corner = 4 * ivec3(x, y, z);
                found |= finer_block(ivec3(x, y, z)) & box_bits(low - corner, high - corner);
            }
        }
    }
    return (found.x | found.y) != 0u;
}

void main() {
    uint index = gl_GlobalInvocationID.x;
    uint blocks = params.coarser_blocks;
    if (index >= blocks * blocks * blocks) return;
    ivec3 block = ivec3(index % blocks, index / blocks % blocks, index / (blocks * blocks));
    uvec2 points = uvec2(0u), tiles = uvec2(0u);
    if (any_point(8 * block - params.point_reach, 8 * block + 8)) {
        for (uint bit = 0u; bit < 64u; ++bit) {
            ivec3 at = 4 * block + ivec3(child_offset(bit & 7u) + 2u * child_offset(bit >> 3));
            uvec2 mask = bit < 32u ? uvec2(1u << bit, 0u) : uvec2(0u, 1u << (bit - 32u));
            if (any_point(2 * at - params.point_reach, 2 * at + 1)) points |= mask;
            if (all(lessThan(at, ivec3(params.tile_limit))) && any_point(2 * at - params.tile_reach, 2 * at + 2)) tiles |= mask;
        }
    }
    coarser_points[index] = points;
    level_tiles[index] = tiles;
    uint count = uint(bitCount(tiles.x) + bitCount(tiles.y));
    if (count != 0u) atomicAdd(tile_counts[params.level], count);
}
