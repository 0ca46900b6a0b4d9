#version 460
#extension GL_GOOGLE_include_directive : require
// svo.list_touched: the touched tiles of a level as a list, in an order that does not matter, and the arguments of the dispatches over it. A thread 32 tiles.
layout(local_size_x = 256) in;

#include "shared/prefix_sum.glsl"
#include "gi/svo/pool.glsl"
#include "gi/svo/touched.glsl"

layout(std430, set = 1, binding = 0) restrict readonly buffer TouchedBits { uint touched_bits[]; };
layout(std430, set = 1, binding = 1) restrict buffer TouchedLevels { Touched touched_levels[]; };
layout(std430, set = 1, binding = 2) restrict writeonly buffer TouchedTiles { uint touched_tiles[]; };

layout(push_constant) uniform ListTouchedParams { uint first; uint count; uint level; } params;

shared uint list_start;

void main() {
    uint word = gl_GlobalInvocationID.x;
    uint bits = 32u * word < params.count ? touched_bits[word] : 0u, total;
    uint at = workgroup_prefix_sum(uint(bitCount(bits)), total);
    if (gl_LocalInvocationIndex == 0u && total != 0u) {
        list_start = atomicAdd(touched_levels[params.level].count, total);
        uint texel_groups = (list_start + total + 7u) / 8u, tile_groups = (list_start + total + 63u) / 64u;
        atomicMax(touched_levels[params.level].texel_groups_x, min(texel_groups, 65535u));
        atomicMax(touched_levels[params.level].texel_groups_y, (texel_groups + 65534u) / 65535u);
        atomicMax(touched_levels[params.level].texel_groups_z, 1u);
        atomicMax(touched_levels[params.level].tile_groups_x, min(tile_groups, 65535u));
        atomicMax(touched_levels[params.level].tile_groups_y, (tile_groups + 65534u) / 65535u);
        atomicMax(touched_levels[params.level].tile_groups_z, 1u);
    }
    barrier();
    for (at += list_start; bits != 0u; bits &= bits - 1u) touched_tiles[at++] = params.first + 32u * word + uint(findLSB(bits));
}
