#version 460
#extension GL_GOOGLE_include_directive : require
// svo.sum_borders: the nine texels that two bricks share along an axis, where voxels spread to
// their corners (Crassin et al. 2011, figure 7, with both directions of an axis in one pass).
//
// Both bricks have a share of each texel, and both get the sum. After the three axes every copy of
// a texel is the same sum. A thread a tile.
layout(local_size_x = 64) in;

#include "gi/voxel_cones/svo/pool.glsl"
#include "gi/voxel_cones/svo/touched.glsl"

layout(constant_id = 0) const uint FACES = 1;     // bricks of a tile: 1, or 6, one a face

layout(std430, set = 1, binding = 0) restrict readonly buffer Neighbours { uint neighbours[]; };
layout(set = 1, binding = 1, rgba16f) uniform restrict image3D bricks;

layout(push_constant) uniform SumParams {
    uint first;
    uint count;
    uint first_dynamic;
    uint dynamic_count;
    uint axis;
    uint shift;            // bricks from a tile's index to that of its first brick
    uint stride;           // from a face to the next
} params;

void main() {
    uint index = linear_group(gl_WorkGroupID) * 64u + gl_LocalInvocationIndex;
    if (index >= params.count + params.dynamic_count) return;
    uint tile = nth_tile(index, params.first, params.count, params.first_dynamic);
    uint neighbour = neighbours[3u * tile + params.axis];
    if (neighbour == 0u) return;
    ivec3 size = imageSize(bricks);
    for (uint face = 0u; face < FACES; ++face) {
        uint brick = params.shift + face * params.stride;
        ivec3 high = brick_texel(tile + brick, size),
              low = brick_texel(neighbour - 1u + brick, size);
        low[params.axis] += 2;
        for (int pair = 0; pair < 9; ++pair) {
            ivec3 across = ivec3(0);
            across[(params.axis + 1u) % 3u] = pair % 3;
            across[(params.axis + 2u) % 3u] = pair / 3;
            vec4 sum = imageLoad(bricks, low + across) + imageLoad(bricks, high + across);
            imageStore(bricks, low + across, sum);
            imageStore(bricks, high + across, sum);
        }
    }
}
