// The node pool and the brick pool of the sparse voxel octree.
//
// A level's texels are lattice points at whole numbers; node c spans the cell from point c to c +
// 1, tile T the nodes 2T and 2T + 1 along each axis, and its brick holds the 3³ points 2T, 2T + 1,
// 2T + 2. Tile index and brick index are the same. Point q of level l, in voxels, is at 2^l (q +
// ½), the centre of a texel of a dense mip, or with CORNERS at 2^l q, a corner of voxels.
#ifndef LUMIVOX_POOL
#define LUMIVOX_POOL

// bits  0          8                       32
// tile  | children | first child            |   which of the eight nodes have a child, x fastest;
// the children follow each other in the pool, and those of
//                                               a leaf tile are voxels, by compact index
bool has_child(uint tile, uint node) {
    return (tile >> node & 1u) != 0u;
}

// The child of a node that has one.
uint child_of(uint tile, uint node) {
    return (tile >> 8) + uint(bitCount(tile & (1u << node) - 1u));
}

// Tiles of a workgroup of 64 threads, in the passes that build the pool.
const uint TILES_PER_THREAD = 16u, TILES_PER_GROUP = 64u * TILES_PER_THREAD;

// One level of the pool; the last three words are the arguments of an indirect dispatch over its
// tiles.
struct Level {
    uint first;      // index of its first tile
    uint count;      // its tiles
    uint groups_x;
    uint groups_y;
    uint groups_z;
};

// bits 0       10      20      30
// place | x    | y     | z     |    in tiles of its level
uint pack_tile(uvec3 tile) {
    return tile.x | tile.y << 10 | tile.z << 20;
}

uvec3 unpack_tile(uint packed) {
    return uvec3(packed, packed >> 10, packed >> 20) & 1023u;
}

uint child_index(uvec3 node) {
    uvec3 low = node & 1u;
    return low.x | low.y << 1 | low.z << 2;
}

uvec3 child_offset(uint child) {
    return uvec3(child & 1u, child >> 1 & 1u, child >> 2);
}

// The eight bits of a block of 4×4×4 (gi/shared/voxel/grid.glsl) from bit `first` on: those of a
// tile's nodes.
uint tile_bits(uvec2 block, uint first) {
    return (first < 32u ? block.x : block.y) >> (first & 31u) & 255u;
}

// First texel of a brick in a pool of this many texels, whose width and height in bricks are powers
// of two.
ivec3 brick_texel(uint brick, ivec3 pool_texels) {
    uvec2 bits = uvec2(findMSB(uvec2(pool_texels.xy) / 3u));
    return 3
        * ivec3(brick & (1u << bits.x) - 1u, brick >> bits.x & (1u << bits.y) - 1u,
            brick >> bits.x + bits.y);
}

// Workgroup of a dispatch that goes on in y after 65,535.
uint linear_group(uvec3 group) {
    return group.x + group.y * 65535u;
}

#endif
