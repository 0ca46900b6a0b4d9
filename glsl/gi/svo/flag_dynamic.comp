#version 460
#extension GL_GOOGLE_include_directive : require
// svo.flag_dynamic: how many dynamic children each 256 dynamic tiles of a level have. A thread a tile.
layout(local_size_x = 256) in;

#include "shared/prefix_sum.glsl"
#include "gi/svo/pool.glsl"

layout(std430, set = 1, binding = 0) restrict readonly buffer Levels { Level levels[]; };
layout(std430, set = 1, binding = 1) restrict readonly buffer Nodes { uint nodes[]; };
layout(std430, set = 1, binding = 2) restrict readonly buffer Places { uint places[]; };
layout(std430, set = 1, binding = 3) restrict readonly buffer Originals { uint originals[]; };
layout(std430, set = 1, binding = 4) restrict readonly buffer AffectedTiles { uvec2 affected_tiles[]; };
layout(std430, set = 1, binding = 5) restrict writeonly buffer GroupSums { uint group_sums[]; };

#include "gi/svo/dynamic_children.glsl"

void main() {
    Level level = levels[params.level];
    uint group = linear_group(gl_WorkGroupID);
    uint index = group * 256u + gl_LocalInvocationIndex;
    uint slot = dynamic_slot(level.first + index, params.first_dynamic), flags = 0u, total;
    if (index < level.count && slot < params.capacity) flags = dynamic_children(slot, static_word(slot));
    workgroup_prefix_sum(uint(bitCount(flags)), total);
    if (gl_LocalInvocationIndex == 0u && group < uint(group_sums.length())) group_sums[group] = total;
}
