#version 460
#extension GL_GOOGLE_include_directive : require
// svo.allocate_tiles: every flagged node of a level gets the next tile, in the order of the nodes, and the tile its place.
layout(local_size_x = 256) in;

#include "shared/prefix_sum.glsl"
#include "gi/svo/pool.glsl"

layout(std430, set = 1, binding = 0) restrict readonly buffer Levels { Level levels[]; };
layout(std430, set = 1, binding = 1) restrict readonly buffer GroupSums { uint group_sums[]; };
layout(std430, set = 1, binding = 2) restrict buffer Nodes { uint nodes[]; };
layout(std430, set = 1, binding = 3) restrict buffer Tiles { uint tiles[]; };

layout(push_constant) uniform LevelParams { uint level; } params;

void main() {
    Level level = levels[params.level];
    uint group = linear_group(gl_WorkGroupID);
    uint node = group * 256u + gl_LocalInvocationIndex;
    uint tile = level.first + node / 8u;
    bool is_flagged = node < 8u * level.count && nodes[8u * tile + (node & 7u)] != 0u;
    uint total;
    uint rank = workgroup_prefix_sum(uint(is_flagged), total);
    if (!is_flagged) return;
    uint child = level.first + level.count + group_sums[group] + rank;
    nodes[8u * tile + (node & 7u)] = NODE_FLAG | child;
    tiles[child] = pack_tile(2u * unpack_tile(tiles[tile]) + child_offset(node & 7u));
}
