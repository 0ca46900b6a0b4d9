#version 460
#extension GL_GOOGLE_include_directive : require
// svo.pack_blocks: the occupancy of the 4³ voxels of each tile of level 1, a bit each in Morton
// order, and the number of the first of them that is there.
layout(local_size_x = 64) in;

#include "gi/voxel_cones/svo/pool.glsl"

layout(std430, set = 1, binding = 0) restrict readonly buffer Nodes { uint nodes[]; };
// three words a block
layout(std430, set = 1, binding = 1) restrict writeonly buffer Blocks { uint blocks[]; };

layout(push_constant) uniform PackParams {
    uint first_tile;
    uint tile_count;
    uint first_block;
} params;

void main() {
    uint index = gl_GlobalInvocationID.x + gl_GlobalInvocationID.y * 4194240u;
    if (index >= params.tile_count) return;
    uint word = nodes[params.first_tile + index], first_voxel = 0xffffffffu;
    uvec2 bits = uvec2(0u);
    for (uint node = 0u; node < 8u; ++node) {
        if (!has_child(word, node)) continue;
        uint leaf = nodes[child_of(word, node)], voxels = leaf & 255u;
        bits[node >> 2] |= voxels << 8u * (node & 3u);
        // Voxels of a block follow each other in this order.
        if (voxels != 0u) first_voxel = min(first_voxel, leaf >> 8);
    }
    uint at = 3u * (params.first_block + index);
    blocks[at] = bits.x;
    blocks[at + 1u] = bits.y;
    blocks[at + 2u] = first_voxel;
}
