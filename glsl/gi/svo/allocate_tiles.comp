#version 460
#extension GL_GOOGLE_include_directive : require
// svo.allocate_tiles: every flagged node of a level gets the next tile, in the order of the nodes, and the tile its place. A thread a tile.
layout(local_size_x = 256) in;

#include "shared/prefix_sum.glsl"
#include "gi/svo/pool.glsl"

layout(std430, set = 1, binding = 0) restrict readonly buffer Levels { Level levels[]; };
layout(std430, set = 1, binding = 1) restrict readonly buffer GroupSums { uint group_sums[]; };
layout(std430, set = 1, binding = 2) restrict buffer Nodes { uint nodes[]; };
layout(std430, set = 1, binding = 3) restrict buffer Tiles { uint tiles[]; };

layout(push_constant) uniform LevelParams { uint level; uint first_free; } params;

void main() {
    Level level = levels[params.level];
    uint group = linear_group(gl_WorkGroupID);
    uint index = group * 256u + gl_LocalInvocationIndex;
    uint tile = level.first + index;
    uint flags = index < level.count ? nodes[tile] : 0u;
    uint total;
    uint child = level.first + level.count + group_sums[group] + workgroup_prefix_sum(uint(bitCount(flags)), total);
    if (index >= level.count) return;
    uvec3 first = 2u * unpack_tile(tiles[tile]);
    nodes[tile] = child << 8 | flags;
    for (uint node = 0u; node < 8u; ++node) {
        if (has_child(flags, node)) tiles[child++] = pack_tile(first + child_offset(node));
    }
}
