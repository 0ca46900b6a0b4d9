#version 460
#extension GL_GOOGLE_include_directive : require
// svo.allocate_tiles: every flagged node of a level gets the next tile, in the order of the nodes,
// and the tile its place and no children as yet. A thread 16 tiles that follow each other.
layout(local_size_x = 64) in;

#include "shared/prefix_sum.glsl"
#include "gi/voxel_cones/svo/pool.glsl"

layout(std430, set = 1, binding = 0) restrict readonly buffer Levels { Level levels[]; };
layout(std430, set = 1, binding = 1) restrict readonly buffer GroupSums { uint group_sums[]; };
layout(std430, set = 1, binding = 2) restrict buffer Nodes { uint nodes[]; };
layout(std430, set = 1, binding = 3) restrict buffer Tiles { uint tiles[]; };

layout(push_constant) uniform LevelParams { uint level; uint first_child; } params;

void main() {
    Level level = levels[params.level];
    uint group = linear_group(gl_WorkGroupID),
         index = TILES_PER_GROUP * group + TILES_PER_THREAD * gl_LocalInvocationIndex;
    uint end = min(index + TILES_PER_THREAD, level.count), count = 0u, total;
    for (uint i = index; i < end; ++i) count += uint(bitCount(nodes[level.first + i]));
    uint child = workgroup_prefix_sum(count, total);
    if (index >= end) return;
    child += level.first + level.count + group_sums[group];
    for (uint tile = level.first + index; tile < level.first + end; ++tile) {
        uvec3 first = 2u * unpack_tile(tiles[tile]);
        uint flags = nodes[tile];
        nodes[tile] = child << 8 | flags;
        for (uint node = 0u; node < 8u; ++node) {
            if (has_child(flags, node)) {
                tiles[child] = pack_tile(first + child_offset(node));
                nodes[child++] = 0u;
            }
        }
    }
}
