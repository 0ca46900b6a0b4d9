#version 460
#extension GL_GOOGLE_include_directive : require
// svo.link_leaves: every leaf node that is an occupied voxel gets that voxel's compact index.
layout(local_size_x = 256) in;

#include "gi/voxel/grid.glsl"
#include "gi/svo/pool.glsl"

layout(std430, set = 1, binding = 0) restrict readonly buffer Levels { Level levels[]; };
layout(std430, set = 1, binding = 1) restrict readonly buffer Tiles { uint tiles[]; };
layout(std430, set = 1, binding = 2) restrict readonly buffer Occupancy { uvec2 occupancy[]; };
layout(std430, set = 1, binding = 3) restrict readonly buffer BlockBases { uint block_bases[]; };
layout(std430, set = 1, binding = 4) restrict writeonly buffer Nodes { uint nodes[]; };

layout(push_constant) uniform LeafParams { uint resolution; } params;

void main() {
    Level level = levels[0];
    uint node = linear_group(gl_WorkGroupID) * 256u + gl_LocalInvocationIndex;
    if (node >= 8u * level.count) return;
    uint tile = level.first + node / 8u;
    uvec3 voxel = 2u * unpack_tile(tiles[tile]) + child_offset(node & 7u);
    uint block = block_index(voxel, params.resolution), bit = block_bit(voxel);
    uvec2 words = occupancy[block];
    nodes[8u * tile + (node & 7u)] = block_has(words, bit) ? NODE_FLAG | (block_bases[block] + set_bits_below(words, bit)) : 0u;
}
