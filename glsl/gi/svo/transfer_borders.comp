#version 460
#extension GL_GOOGLE_include_directive : require
// svo.transfer_borders: the texels that two bricks share along an axis (Crassin et al. 2011, figure 7, with both directions of an axis in one pass).
//
// A brick's last texels along the axis are its neighbour's first, or zero where there is none; along y they include the last ones along x, which are there
// by then, and along z all nine. With CORNERS both bricks have a share of each of the nine, and both get the sum; after the three axes every copy of a
// texel is the same sum. A thread a tile.
layout(local_size_x = 64) in;

#include "gi/svo/pool.glsl"

layout(constant_id = 0) const uint CORNERS = 0;

layout(std430, set = 1, binding = 0) restrict readonly buffer Neighbours { uint neighbours[]; };
layout(set = 1, binding = 1, rgba16f) uniform restrict image3D bricks;

layout(push_constant) uniform TransferParams { uint first; uint count; uint axis; } params;

void transfer(ivec3 low, ivec3 high, bool is_shared) {
    if (CORNERS == 0u) {
        imageStore(bricks, low, is_shared ? imageLoad(bricks, high) : vec4(0.0));
    } else if (is_shared) {
        vec4 sum = imageLoad(bricks, low) + imageLoad(bricks, high);
        imageStore(bricks, low, sum);
        imageStore(bricks, high, sum);
    }
}

void main() {
    // Pairs along the axis after the transfer's, and along the one after that (cyclically).
    uint row = 3u, column = 3u;
    if (CORNERS == 0u) {
        row = params.axis == 2u ? 3u : 2u;
        column = params.axis == 0u ? 2u : 3u;
    }
    uint index = linear_group(gl_WorkGroupID) * 64u + gl_LocalInvocationIndex;
    if (index >= params.count) return;
    uint tile = params.first + index, neighbour = neighbours[3u * tile + params.axis];
    ivec3 size = imageSize(bricks), first_low = brick_texel(tile, size), first_high = brick_texel(max(neighbour, 1u) - 1u, size);
    first_low[params.axis] += 2;
    for (uint pair = 0u; pair < row * column; ++pair) {
        ivec3 across = ivec3(0);
        across[(params.axis + 1u) % 3u] = int(pair % row);
        across[(params.axis + 2u) % 3u] = int(pair / row);
        transfer(first_low + across, first_high + across, neighbour != 0u);
    }
}
