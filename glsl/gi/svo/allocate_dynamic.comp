#version 460
#extension GL_GOOGLE_include_directive : require
// svo.allocate_dynamic: the words of the dynamic tiles of a level: with children of their own behind those of the tiles before, or with those of the static
// tile; and the children's places and static tiles. What there is no room for is counted (svo.scan_nodes) and left out. A thread a tile.
layout(local_size_x = 256) in;

#include "shared/prefix_sum.glsl"
#include "gi/svo/pool.glsl"

layout(std430, set = 1, binding = 0) restrict readonly buffer Levels { Level levels[]; };
layout(std430, set = 1, binding = 1) restrict readonly buffer GroupSums { uint group_sums[]; };
layout(std430, set = 1, binding = 2) restrict readonly buffer AffectedTiles { uvec2 affected_tiles[]; };
layout(std430, set = 1, binding = 3) restrict buffer Nodes { uint nodes[]; };
layout(std430, set = 1, binding = 4) restrict buffer Places { uint places[]; };
layout(std430, set = 1, binding = 5) restrict buffer Originals { uint originals[]; };   // index + 1 of the static tile, or 0

#include "gi/svo/dynamic_children.glsl"

void main() {
    Level level = levels[params.level];
    uint group = linear_group(gl_WorkGroupID);
    uint index = group * 256u + gl_LocalInvocationIndex;
    uint tile = level.first + index, slot = dynamic_slot(tile, params.first_dynamic);
    bool is_there = index < level.count && slot < params.capacity;
    uint word = is_there ? static_word(slot) : 0u, flags = is_there ? dynamic_children(slot, word) : 0u, total;
    uint before = workgroup_prefix_sum(uint(bitCount(flags)), total);
    if (!is_there) return;
    uint child = levels[params.level - 1u].first + group_sums[group] + before;
    nodes[tile] = flags == 0u ? word : child << 8 | flags;
    uvec3 first = 2u * unpack_tile(places[slot]);
    for (uint node = 0u; node < 8u; ++node) {
        if (!has_child(flags, node)) continue;
        uint child_slot = dynamic_slot(child++, params.first_dynamic);
        if (child_slot >= params.capacity) continue;
        places[child_slot] = pack_tile(first + child_offset(node));
        originals[child_slot] = has_child(word, node) ? child_of(word, node) + 1u : 0u;
    }
}
