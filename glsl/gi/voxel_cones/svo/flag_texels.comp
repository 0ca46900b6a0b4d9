#version 460
#extension GL_GOOGLE_include_directive : require
// svo.flag_texels: which texels of a dynamic tile's brick are made anew: those whose holders, the
// tiles of the level that share them, are all affected and so are dynamic. One that has another
// holder no touched block reaches, and it is what the static tile has. A thread a tile.
layout(local_size_x = 64) in;

#include "gi/shared/voxel/grid.glsl"
#include "gi/voxel_cones/svo/dynamic.glsl"
#include "gi/voxel_cones/svo/pool.glsl"

layout(constant_id = 0) const uint CORNERS = 0;

layout(std430, set = 1, binding = 0) restrict readonly buffer Places { uint places[]; };
layout(std430, set = 1, binding = 1) restrict readonly buffer AffectedTiles {
    uvec2 affected_tiles[];
};
// 27 bits, x fastest
layout(std430, set = 1, binding = 2) restrict writeonly buffer RemadeTexels {
    uint remade_texels[];
};

layout(push_constant) uniform TexelParams {
    uint first;           // first dynamic tile of the level
    uint count;           // its dynamic tiles
    uint first_dynamic;   // of all levels
    uint first_block;     // of the level in `affected_tiles`
    uint blocks;          // of the level along an axis
    uint tiles;           // likewise
} params;

// Beyond the grid nothing holds a texel; on centres its last texels are no voxels either, and stay
// what they are: zero.
bool is_affected(ivec3 tile) {
    if (any(lessThan(tile, ivec3(0)))) return true;
    if (any(greaterThanEqual(tile, ivec3(params.tiles)))) return CORNERS != 0u;
    return block_has(
        affected_tiles[params.first_block + block_index(uvec3(tile), 4u * params.blocks)],
        block_bit(uvec3(tile)));
}

// Along an axis the first texel has the holders before and here, the second this one, the last this
// one and the next. A bit a texel, or a tile of the 3³ around this one, whose neighbours along the
// axis are `step` bits away; `middle` are the bits in the middle along it.
uint held_along(uint affected, uint middle, uint step) {
    return affected
        & (middle | middle >> step & affected >> step | middle << step & affected << step);
}

void main() {
    uint index = linear_group(gl_WorkGroupID) * 64u + gl_LocalInvocationIndex;
    if (index >= params.count) return;
    uint slot = dynamic_slot(params.first + index, params.first_dynamic);
    ivec3 place = ivec3(unpack_tile(places[slot]));
    uint affected = 0u;
    for (int i = 0; i < 27; ++i)
        affected |= uint(is_affected(place + ivec3(i % 3, i / 3 % 3, i / 9) - 1)) << i;
    remade_texels[slot] =
        held_along(held_along(held_along(affected, 0x2492492u, 1u), 0xe07038u, 3u), 0x3fe00u, 9u);
}
