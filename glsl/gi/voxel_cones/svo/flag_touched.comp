#version 460
#extension GL_GOOGLE_include_directive : require
// svo.flag_touched: which tiles of a level light has touched: a leaf tile with a voxel that is lit,
// or was in the last update, and a tile with a touched child (Crassin et al. 2011, section 6); and
// their neighbours towards −x, −y and −z, whose bricks hold copies of their texels. A thread a
// tile.
layout(local_size_x = 64) in;

#include "gi/voxel_cones/svo/pool.glsl"

layout(constant_id = 0) const uint LEAVES = 0;
layout(constant_id = 1) const uint SIDES = 1;   // radiances of a voxel

layout(std430, set = 1, binding = 0) restrict readonly buffer Nodes { uint nodes[]; };
layout(std430, set = 1, binding = 1) restrict readonly buffer Neighbours { uint neighbours[]; };
layout(std430, set = 1, binding = 2) restrict readonly buffer VoxelRadiance {
    uvec2 voxel_radiance[];
};
// a bit a tile of the finer level
layout(std430, set = 1, binding = 3) restrict readonly buffer TouchedChildren {
    uint touched_children[];
};
// a bit a tile of this level
layout(std430, set = 1, binding = 4) restrict buffer TouchedBits { uint touched_bits[]; };
// in the last update, a bit a leaf tile
layout(std430, set = 1, binding = 5) restrict buffer LitLeaves { uint lit_leaves[]; };

#include "gi/voxel_cones/svo/before.glsl"

layout(push_constant) uniform TouchParams { uint first; uint count; uint first_child; } params;

bool is_lit(uint tile) {
    uint all = 0u;
    uint end = (tile >> 8) + uint(bitCount(tile & 255u));
    for (uint side = SIDES * (tile >> 8); side < SIDES * end; ++side) {
        uvec2 packed = voxel_radiance[side];
        all |= packed.x | packed.y & 0xffffu;   // r, g, b, without opacity
    }
    return all != 0u;
}

// The children's bits follow each other, in one word or two.
bool has_touched_child(uint tile) {
    uint count = uint(bitCount(tile & 255u)), first = (tile >> 8) - params.first_child,
         shift = first & 31u;
    if (count == 0u) return false;
    uint bits = touched_children[first >> 5] >> shift;
    if (shift + count > 32u) bits |= touched_children[(first >> 5) + 1u] << (32u - shift);
    return (bits & (1u << count) - 1u) != 0u;
}

void touch(uint tile) {
    if (tile == 0u) return;
    uint index = tile - 1u - params.first;
    atomicOr(touched_bits[index >> 5], 1u << (index & 31u));
}

void main() {
    uint index = linear_group(gl_WorkGroupID) * 64u + gl_LocalInvocationIndex;
    if (index >= params.count) return;
    uint tile = nodes[params.first + index];
    bool is_touched;
    if (LEAVES != 0u) {
        uint bit = 1u << (index & 31u);
        bool is_now = is_lit(tile), was = (lit_leaves[index >> 5] & bit) != 0u;
        if (is_now != was) atomicXor(lit_leaves[index >> 5], bit);
        is_touched = is_now || was;
    } else {
        is_touched = has_touched_child(tile);
    }
    if (!is_touched) return;
    uint own = params.first + index + 1u, x = before(own, 0u), y = before(own, 1u),
         z = before(own, 2u), xy = before(x, 1u);
    touch(own);
    touch(x);
    touch(y);
    touch(z);
    touch(xy);
    touch(before(x, 2u));
    touch(before(y, 2u));
    touch(before(xy, 2u));
}
