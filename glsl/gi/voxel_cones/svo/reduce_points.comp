#version 460
#extension GL_GOOGLE_include_directive : require
// svo.reduce_points: which points of the next coarser lattice, and which tiles of this level, have
// something to hold.
//
// Point q of the coarser lattice is made of the finer ones 2q and 2q + 1 (of corners: 2q − 1 to 2q
// + 1), tile T holds the points 2T to 2T + 2: each is there where any of those is. So a texel that
// is not zero has a brick in every tile that it borders on. A thread a block of 4×4×4 finer points
// (gi/shared/voxel/grid.glsl), which adds to its own block and to those beside it: empty blocks,
// nearly all, cost no more than a look, and nothing where those that are not are listed.
layout(local_size_x = 64) in;

#include "gi/voxel_cones/svo/pool.glsl"

// How far below 2q a coarser point reaches: 0 on centres, 1 on corners, and 2 where the finer bits
// are voxels that spread to the points v and v + 1.
layout(constant_id = 0) const int POINT_REACH = 0;
// likewise a tile below 2T: 1 where they are such voxels
layout(constant_id = 1) const int TILE_REACH = 0;
layout(constant_id = 2) const uint LISTED = 0;   // 1: finer blocks are those of a list

layout(std430, set = 1, binding = 0) restrict readonly buffer FinerPoints { uvec2 finer_points[]; };
// two words a block
layout(std430, set = 1, binding = 1) restrict buffer CoarserPoints { uint coarser_points[]; };
// likewise
layout(std430, set = 1, binding = 2) restrict buffer TileBits { uint level_tiles[]; };
layout(std430, set = 1, binding = 3) restrict buffer TileCounts { uint tile_counts[]; };
layout(std430, set = 1, binding = 4) restrict readonly buffer FilledBlocks {
    uint filled_blocks[];
};

layout(push_constant) uniform ReduceParams {
    uint finer_blocks;     // along an axis, as are all counts
    int first_x;           // block of the whole lattice at which the finer ones begin
    int first_y;
    int first_z;
    uint point_blocks;
    uint tile_blocks;
    uint tile_limit;       // tiles of the level
    uint level;
    uint block_count;      // that are looked at
} params;

// The points of a block in its plane `at` across an axis, moved to plane 0.
uvec2 plane(uvec2 points, uint axis, uint at) {
    uint low = at & 1u, high = at >> 1;
    if (axis == 2u) return uvec2((high == 0u ? points.x : points.y) >> 4u * low & 0x0f0f0f0fu, 0u);
    return axis == 0u ? points >> (low + 8u * high) & 0x00550055u
                      : points >> (2u * low + 16u * high) & 0x00003333u;
}

// One axis of cells: the two of the block `side` blocks on from these points that reach one, in its
// planes 0 and 2. A cell is two planes, and so many more `below` and `above` them.
uvec2 reduce_axis(uvec2 points, uint axis, int side, int below, int above) {
    uvec2 p0 = plane(points, axis, 0u), p1 = plane(points, axis, 1u), p2 = plane(points, axis, 2u),
          p3 = plane(points, axis, 3u);
    uvec2 first = p0 | p1, second = p2 | p3;
    if (above >= 1) first |= p2;
    if (below >= 1) second |= p1;
    if (below >= 2) second |= p0;
    if (side < 0) { first = uvec2(0u); second = p0; }
    if (side > 0) { first = below >= 2 ? p2 | p3 : p3; second = uvec2(0u); }
    if (axis == 2u) return uvec2(first.x, second.x);
    return first | second << (axis == 0u ? 8u : 16u);
}

// The 2³ cells of the block at `side` that reach one of these points, as bits.
uint reached_cells(uvec2 points, ivec3 side, int below, int above) {
    points = reduce_axis(points, 2u, side.z, below, above);
    points = reduce_axis(points, 1u, side.y, below, above);
    points = reduce_axis(points, 0u, side.x, below, above);
    // Bits 0, 8, 16 and 24 of each word become four that follow each other.
    points = points * 0x01020408u >> 24 & 15u;
    return points.x | points.y << 4;
}

// The cells of a block are a byte of the coarser block that it lies in: the word with it, of so
// many blocks along an axis, and the byte's first bit there.
uint cell_word(uvec3 block, uint coarser_blocks) {
    uvec3 coarser = block >> 1;
    return 2u * (coarser.x + coarser_blocks * (coarser.y + coarser_blocks * coarser.z))
        + (child_index(block) >> 2);
}

uint cell_shift(uvec3 block) {
    return 8u * (child_index(block) & 3u);
}

void add_points(uvec2 finer, ivec3 block, ivec3 side) {
    uint cells = reached_cells(finer, side, POINT_REACH, 0);
    uvec3 beside = uvec3(block + side);
    if (cells != 0u)
        atomicOr(
            coarser_points[cell_word(beside, params.point_blocks)], cells << cell_shift(beside));
}

// Returns how many tiles there were not before.
uint add_tiles(uvec2 finer, ivec3 block, ivec3 side) {
    uint cells = reached_cells(finer, side, TILE_REACH, 1);
    uvec3 beside = uvec3(block + side);
    // Outside of the grid there are no tiles, nor at −1, a large number here; the root's level has
    // one.
    if (any(greaterThanEqual(beside, uvec3(params.tile_limit + 1u >> 1)))) cells = 0u;
    if (params.tile_limit == 1u) cells &= 1u;
    uint added = 0u;
    if (cells != 0u) {
        uint bits = cells << cell_shift(beside);
        added = uint(
            bitCount(bits & ~atomicOr(level_tiles[cell_word(beside, params.tile_blocks)], bits)));
    }
    return added;
}

void main() {
    uint index = linear_group(gl_WorkGroupID) * 64u + gl_LocalInvocationIndex,
         n = params.finer_blocks;
    if (index >= params.block_count) return;
    if (LISTED != 0u) index = filled_blocks[index];
    uvec2 finer = finer_points[index];
    uint added = 0u;
    // One turn or none of a loop, and not a branch: a software driver takes every branch, but
    // leaves a loop when it may.
    for (int turn = int((finer.x | finer.y) != 0u); turn > 0; --turn) {
        ivec3 block = ivec3(params.first_x, params.first_y, params.first_z)
            + ivec3(index % n, index / n % n, index / (n * n));
        for (int z = 0; z <= min(POINT_REACH, 1); ++z) {
            for (int y = 0; y <= min(POINT_REACH, 1); ++y) {
                for (int x = 0; x <= min(POINT_REACH, 1); ++x)
                    add_points(finer, block, ivec3(x, y, z));
            }
        }
        for (int z = -1; z <= TILE_REACH; ++z) {
            for (int y = -1; y <= TILE_REACH; ++y) {
                for (int x = -1; x <= TILE_REACH; ++x)
                    added += add_tiles(finer, block, ivec3(x, y, z));
            }
        }
    }
    if (added != 0u) atomicAdd(tile_counts[params.level], added);
}
