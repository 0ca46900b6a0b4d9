#version 460
#extension GL_GOOGLE_include_directive : require
// svo.transfer_borders: the texels that two bricks share along an axis (Crassin et al. 2011, figure
// 7, with both directions of an axis in one pass).
//
// A brick's last texels along the axis are its neighbour's first, or zero where there is none;
// along y they include the last ones along x, which are there by then, and along z all nine. So a
// brick's first texels go to the neighbour before it. With CORNERS both bricks have a share of each
// of the nine, and both get the sum; after the three axes every copy of a texel is the same sum. A
// thread a tile.
layout(local_size_x = 64) in;

#include "gi/voxel_cones/svo/pool.glsl"
#include "gi/voxel_cones/svo/touched.glsl"

layout(constant_id = 0) const uint CORNERS = 0;
layout(constant_id = 1) const uint FACES = 1;     // bricks of a tile: 1, or 6, one a face
layout(constant_id = 2) const uint TOUCHED = 0;   // 1: from the touched tiles, 0: from all

layout(std430, set = 1, binding = 0) restrict readonly buffer Neighbours { uint neighbours[]; };
layout(set = 1, binding = 1, rgba16f) uniform restrict image3D bricks;
layout(std430, set = 1, binding = 2) restrict readonly buffer TouchedLevels {
    Touched touched_levels[];
};
layout(std430, set = 1, binding = 3) restrict readonly buffer TouchedTiles {
    uint touched_tiles[];
};

layout(push_constant) uniform TransferParams {
    uint first;
    uint count;
    uint first_dynamic;
    uint dynamic_count;
    uint level;
    uint axis;
    uint shift;            // bricks from a tile's index to that of its first brick
    uint stride;           // from a face to the next
} params;

void transfer(ivec3 low, ivec3 high) {
    vec4 texel = imageLoad(bricks, high);
    if (CORNERS != 0u) {
        texel += imageLoad(bricks, low);
        imageStore(bricks, high, texel);
    }
    imageStore(bricks, low, texel);
}

void main() {
    // Pairs along the axis after the transfer's, and along the one after that (cyclically).
    uint row = 3u, column = 3u;
    if (CORNERS == 0u) {
        row = params.axis == 2u ? 3u : 2u;
        column = params.axis == 0u ? 2u : 3u;
    }
    uint index = linear_group(gl_WorkGroupID) * 64u + gl_LocalInvocationIndex;
    uint count =
        TOUCHED != 0u ? touched_levels[params.level].count : params.count + params.dynamic_count;
    if (index >= count) return;
    uint tile = TOUCHED != 0u ? touched_tiles[index]
                              : nth_tile(index, params.first, params.count, params.first_dynamic);
    uint neighbour = neighbours[3u * tile + params.axis];
    if (neighbour == 0u) return;
    ivec3 size = imageSize(bricks);
    for (uint face = 0u; face < FACES; ++face) {
        uint brick = params.shift + face * params.stride;
        ivec3 first_high = brick_texel(tile + brick, size),
              first_low = brick_texel(neighbour - 1u + brick, size);
        first_low[params.axis] += 2;
        for (uint pair = 0u; pair < row * column; ++pair) {
            ivec3 across = ivec3(0);
            across[(params.axis + 1u) % 3u] = int(pair % row);
            across[(params.axis + 2u) % 3u] = int(pair / row);
            transfer(first_low + across, first_high + across);
        }
    }
}
