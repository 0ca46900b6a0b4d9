#version 460
#extension GL_GOOGLE_include_directive : require
// svo.allocate_dynamic: the words of the dynamic tiles of a level: with children of their own
// behind those of the tiles before, or with those of the static tile; and the children's places and
// static tiles. What there is no room for is counted (svo.scan_nodes) and left out. A thread 16
// tiles that follow each other.
layout(local_size_x = 64) in;

#include "shared/prefix_sum.glsl"
#include "gi/voxel_cones/svo/pool.glsl"

layout(std430, set = 1, binding = 0) restrict readonly buffer Levels { Level levels[]; };
layout(std430, set = 1, binding = 1) restrict readonly buffer GroupSums { uint group_sums[]; };
layout(std430, set = 1, binding = 2) restrict readonly buffer AffectedTiles {
    uvec2 affected_tiles[];
};
layout(std430, set = 1, binding = 3) restrict buffer Nodes { uint nodes[]; };
layout(std430, set = 1, binding = 4) restrict buffer Places { uint places[]; };
// index + 1 of the static tile, or 0
layout(std430, set = 1, binding = 5) restrict buffer Originals { uint originals[]; };

#include "gi/voxel_cones/svo/dynamic_children.glsl"

void main() {
    Level level = levels[params.level];
    uint group = linear_group(gl_WorkGroupID),
         index = TILES_PER_GROUP * group + TILES_PER_THREAD * gl_LocalInvocationIndex;
    uint slot = dynamic_slot(level.first + index, params.first_dynamic), count = 0u, total;
    uint tiles = min(min(TILES_PER_THREAD, level.count - min(index, level.count)),
        params.capacity - min(slot, params.capacity));
    for (uint i = 0u; i < tiles; ++i)
        count += uint(bitCount(dynamic_children(slot + i, static_word(slot + i))));
    uint child = workgroup_prefix_sum(count, total);
    if (tiles == 0u) return;
    child += levels[params.level - 1u].first + group_sums[group];
    for (uint i = 0u; i < tiles; ++i) {
        uint word = static_word(slot + i), flags = dynamic_children(slot + i, word);
        nodes[level.first + index + i] = flags == 0u ? word : child << 8 | flags;
        uvec3 first = 2u * unpack_tile(places[slot + i]);
        for (uint node = 0u; node < 8u; ++node) {
            if (!has_child(flags, node)) continue;
            uint child_slot = dynamic_slot(child++, params.first_dynamic);
            if (child_slot >= params.capacity) continue;
            places[child_slot] = pack_tile(first + child_offset(node));
            originals[child_slot] = has_child(word, node) ? child_of(word, node) + 1u : 0u;
        }
    }
}
