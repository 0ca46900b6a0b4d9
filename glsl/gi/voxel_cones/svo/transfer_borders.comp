#version 460
#extension GL_GOOGLE_include_directive : require
// svo.transfer_borders: the texels that bricks share (Crassin et al. 2011, figure 7, with all axes
// and both directions in one pass).
//
// A brick's first 2³ texels are its own. The others are copies of first texels of the bricks behind
// it, so each brick gives its first texels to the seven before it. A thread a tile.
layout(local_size_x = 64) in;

#include "gi/voxel_cones/svo/pool.glsl"
#include "gi/voxel_cones/svo/touched.glsl"

layout(constant_id = 0) const uint FACES = 1;     // bricks of a tile: 1, or 6, one a face
layout(constant_id = 1) const uint TOUCHED = 0;   // 1: from the touched tiles, 0: from all

layout(std430, set = 1, binding = 0) restrict readonly buffer Neighbours { uint neighbours[]; };
layout(set = 1, binding = 1, rgba16f) uniform restrict image3D bricks;
layout(std430, set = 1, binding = 2) restrict readonly buffer TouchedLevels {
    Touched touched_levels[];
};
layout(std430, set = 1, binding = 3) restrict readonly buffer TouchedTiles {
    uint touched_tiles[];
};

#include "gi/voxel_cones/svo/before.glsl"

layout(push_constant) uniform TransferParams {
    uint first;
    uint count;
    uint first_dynamic;
    uint dynamic_count;
    uint level;
    uint shift;            // bricks from a tile's index to that of its first brick
    uint stride;           // from a face to the next
} params;

// From a tile to the one before it along the axes where `side` is 1; both are indices + 1.
void give(uint tile, uint to, ivec3 side) {
    if (to == 0u) return;
    ivec3 size = imageSize(bricks), kept = 2 - side;
    for (uint face = 0u; face < FACES; ++face) {
        uint brick = params.shift + face * params.stride;
        ivec3 given = brick_texel(tile - 1u + brick, size),
              taken = brick_texel(to - 1u + brick, size) + 2 * side;
        for (int z = 0; z < kept.z; ++z)
            for (int y = 0; y < kept.y; ++y)
                for (int x = 0; x < kept.x; ++x)
                    imageStore(
                        bricks, taken + ivec3(x, y, z), imageLoad(bricks, given + ivec3(x, y, z)));
    }
}

void main() {
    uint index = linear_group(gl_WorkGroupID) * 64u + gl_LocalInvocationIndex;
    uint count =
        TOUCHED != 0u ? touched_levels[params.level].count : params.count + params.dynamic_count;
    if (index >= count) return;
    uint own = 1u
        + (TOUCHED != 0u ? touched_tiles[index]
                         : nth_tile(index, params.first, params.count, params.first_dynamic));
    uint x = before(own, 0u), y = before(own, 1u), z = before(own, 2u), xy = before(x, 1u);
    give(own, x, ivec3(1, 0, 0));
    give(own, y, ivec3(0, 1, 0));
    give(own, z, ivec3(0, 0, 1));
    give(own, xy, ivec3(1, 1, 0));
    give(own, before(x, 2u), ivec3(1, 0, 1));
    give(own, before(y, 2u), ivec3(0, 1, 1));
    give(own, before(xy, 2u), ivec3(1, 1, 1));
}
