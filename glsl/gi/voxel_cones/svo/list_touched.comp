#version 460
#extension GL_GOOGLE_include_directive : require
// svo.list_touched: the touched tiles of a level, and all dynamic ones, as a list, in an order that
// does not matter, and the arguments of the dispatches over it. A thread 32 tiles.
layout(local_size_x = 256) in;

#include "shared/prefix_sum.glsl"
#include "gi/voxel_cones/svo/pool.glsl"
#include "gi/voxel_cones/svo/touched.glsl"

layout(std430, set = 1, binding = 0) restrict readonly buffer TouchedBits { uint touched_bits[]; };
layout(std430, set = 1, binding = 1) restrict buffer TouchedLevels { Touched touched_levels[]; };
layout(std430, set = 1, binding = 2) restrict writeonly buffer TouchedTiles {
    uint touched_tiles[];
};

layout(push_constant) uniform ListTouchedParams {
    uint first;
    uint count;
    uint first_dynamic;
    uint dynamic_count;
    uint level;
}
params;

shared uint list_start;

void main() {
    uint word = gl_GlobalInvocationID.x, static_words = (params.count + 31u) / 32u,
         first = params.first + 32u * word, bits = 0u, total;
    if (word < static_words) {
        bits = touched_bits[word];
    } else {
        uint before = 32u * (word - static_words);
        first = params.first_dynamic + before;
        if (before < params.dynamic_count)
            bits = 0xffffffffu >> 32u - min(params.dynamic_count - before, 32u);
    }
    uint at = workgroup_prefix_sum(uint(bitCount(bits)), total);
    if (gl_LocalInvocationIndex == 0u && total != 0u) {
        list_start = atomicAdd(touched_levels[params.level].count, total);
        uint texel_groups = (list_start + total + 7u) / 8u,
             tile_groups = (list_start + total + 63u) / 64u;
        atomicMax(touched_levels[params.level].texel_groups_x, min(texel_groups, 65535u));
        atomicMax(touched_levels[params.level].texel_groups_y, (texel_groups + 65534u) / 65535u);
        atomicMax(touched_levels[params.level].texel_groups_z, 1u);
        atomicMax(touched_levels[params.level].tile_groups_x, min(tile_groups, 65535u));
        atomicMax(touched_levels[params.level].tile_groups_y, (tile_groups + 65534u) / 65535u);
        atomicMax(touched_levels[params.level].tile_groups_z, 1u);
    }
    barrier();
    for (at += list_start; bits != 0u; bits &= bits - 1u)
        touched_tiles[at++] = first + uint(findLSB(bits));
}
