#version 460
#extension GL_GOOGLE_include_directive : require
// svo.flag_nodes: which nodes of a level have children (Crassin & Green 2012, section 22.5.1), as
// eight bits in the word of their tile, and how many of each group of tiles. A thread 16 tiles.
layout(local_size_x = 64) in;

#include "gi/shared/voxel/grid.glsl"
#include "gi/voxel_cones/svo/pool.glsl"

layout(std430, set = 1, binding = 0) restrict readonly buffer Levels { Level levels[]; };
layout(std430, set = 1, binding = 1) restrict readonly buffer Tiles { uint tiles[]; };
layout(std430, set = 1, binding = 2) restrict readonly buffer ChildBits { uvec2 child_bits[]; };
layout(std430, set = 1, binding = 3) restrict writeonly buffer Nodes { uint nodes[]; };
layout(std430, set = 1, binding = 4) restrict writeonly buffer GroupSums { uint group_sums[]; };

layout(push_constant) uniform FlagParams { uint level; uint child_blocks; } params;

shared uint total;

void main() {
    if (gl_LocalInvocationIndex == 0u) total = 0u;
    barrier();
    Level level = levels[params.level];
    uint group = linear_group(gl_WorkGroupID), count = 0u;
    for (uint i = 0u; i < TILES_PER_THREAD; ++i) {
        uint index = TILES_PER_GROUP * group + 64u * i + gl_LocalInvocationIndex;
        if (index < level.count) {
            // The children lie in one block of 4×4×4.
            uvec3 first = 2u * unpack_tile(tiles[level.first + index]);
            uint flags = tile_bits(
                child_bits[block_index(first, 4u * params.child_blocks)], block_bit(first));
            nodes[level.first + index] = flags;
            count += uint(bitCount(flags));
        }
    }
    atomicAdd(total, count);
    barrier();
    if (gl_LocalInvocationIndex == 0u && TILES_PER_GROUP * group < level.count)
        group_sums[group] = total;
}
