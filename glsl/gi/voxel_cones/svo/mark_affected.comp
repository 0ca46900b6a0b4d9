#version 460
#extension GL_GOOGLE_include_directive : require
// svo.mark_affected: the tiles of all levels that hold a texel that voxels of touched blocks reach:
// their bricks are not those of the static tree.
//
// On level l a voxel reaches the texel v / 2^l, with CORNERS also the next one along each axis. Of
// the voxels of a block that reach the same texels the first one marks. 64 threads a touched block.
layout(local_size_x = 64) in;

#include "gi/shared/voxel/grid.glsl"
#include "gi/shared/voxel/dynamic/touched.glsl"
#include "gi/voxel_cones/svo/pool.glsl"

layout(constant_id = 0) const uint CORNERS = 0;

layout(std430, set = 1, binding = 0) restrict readonly buffer TouchedBlocks {
    TouchedBlock touched[];
};
layout(std430, set = 1, binding = 1) restrict readonly buffer Occupancy { uvec2 occupancy[]; };
// a bit a tile, 4³ tiles two words, finest level first
layout(std430, set = 1, binding = 2) restrict buffer AffectedTiles { uint affected_tiles[]; };
layout(std430, set = 1, binding = 3) restrict readonly buffer TouchedCounts {
    TouchedCounters counts;
};

layout(push_constant) uniform AffectedParams {
    uint blocks;        // of voxels along an axis of the grid
    uint level_count;
} params;

// Marks the tiles T with 2T ≤ q ≤ 2T + 2 of the texels q that a cell reaches; `first_block` is that
// of the level.
void mark(uint first_block, uint level, uvec3 cell) {
    uint blocks = max(params.blocks >> (level + 1u), 1u),
         tiles = 4u * params.blocks >> (level + 1u);
    uvec3 low = uvec3(max((ivec3(cell) - 1) >> 1, ivec3(0))),
          high = min((cell + CORNERS) >> 1, uvec3(tiles - 1u));
    for (uint z = low.z; z <= high.z; ++z) {
        for (uint y = low.y; y <= high.y; ++y) {
            for (uint x = low.x; x <= high.x; ++x) {
                uvec3 tile = uvec3(x, y, z);
                uint bit = block_bit(tile), mask = 1u << (bit & 31u);
                uint word = 2u * (first_block + block_index(tile, 4u * blocks)) + (bit >> 5);
                if ((affected_tiles[word] & mask) == 0u) atomicOr(affected_tiles[word], mask);
            }
        }
    }
}

void main() {
    uint index = gl_GlobalInvocationID.x + gl_GlobalInvocationID.y * 4194240u;
    if (counts.indexed == 0u || index >= 64u * counts.touched_count) return;
    uint block = touched[index / 64u].block, bit = index % 64u;
    uvec2 words = occupancy[block];
    if (!block_has(words, bit)) return;
    uint n = params.blocks;
    uvec3 voxel = 4u * uvec3(block % n, block / n % n, block / (n * n)) + child_offset(bit & 7u)
        + 2u * child_offset(bit >> 3);
    bool is_first_of_eight = (tile_bits(words, bit & 56u) & (1u << (bit & 7u)) - 1u) == 0u;
    uint levels = set_bits_below(words, bit) == 0u ? params.level_count
        : is_first_of_eight                        ? 2u
                                                   : 1u;
    uint first_block = 0u;
    for (uint level = 0u; level < levels; ++level) {
        mark(first_block, level, voxel >> level);
        uint along = max(n >> (level + 1u), 1u);
        first_block += along * along * along;
    }
}
