#version 460
#extension GL_GOOGLE_include_directive : require
// svo.flag_nodes: which nodes of a level have children (Crassin & Green 2012, section 22.5.1), and how many of each 256.
layout(local_size_x = 256) in;

#include "shared/prefix_sum.glsl"
#include "gi/voxel/grid.glsl"
#include "gi/svo/pool.glsl"

layout(std430, set = 1, binding = 0) restrict readonly buffer Levels { Level levels[]; };
layout(std430, set = 1, binding = 1) restrict readonly buffer Tiles { uint tiles[]; };
layout(std430, set = 1, binding = 2) restrict readonly buffer ChildBits { uvec2 child_bits[]; };
layout(std430, set = 1, binding = 3) restrict writeonly buffer Nodes { uint nodes[]; };
layout(std430, set = 1, binding = 4) restrict writeonly buffer GroupSums { uint group_sums[]; };

layout(push_constant) uniform FlagParams { uint level; uint child_blocks; } params;

void main() {
    Level level = levels[params.level];
    uint group = linear_group(gl_WorkGroupID);
    uint node = group * 256u + gl_LocalInvocationIndex;
    uint flag = 0u;
    if (node < 8u * level.count) {
        uint tile = level.first + node / 8u;
        uvec3 child = 2u * unpack_tile(tiles[tile]) + child_offset(node & 7u);
        flag = uint(block_has(child_bits[block_index(child, 4u * params.child_blocks)], block_bit(child)));
        nodes[8u * tile + (node & 7u)] = flag * NODE_FLAG;
    }
    uint total;
    workgroup_prefix_sum(flag, total);
    if (gl_LocalInvocationIndex == 0u) group_sums[group] = total;
}
