#version 460
#extension GL_GOOGLE_include_directive : require
// svo.flag_dynamic: how many dynamic children each group of dynamic tiles of a level has. A thread
// 16 tiles.
layout(local_size_x = 64) in;

#include "gi/voxel_cones/svo/pool.glsl"

layout(std430, set = 1, binding = 0) restrict readonly buffer Levels { Level levels[]; };
layout(std430, set = 1, binding = 1) restrict readonly buffer Nodes { uint nodes[]; };
layout(std430, set = 1, binding = 2) restrict readonly buffer Places { uint places[]; };
layout(std430, set = 1, binding = 3) restrict readonly buffer Originals { uint originals[]; };
layout(std430, set = 1, binding = 4) restrict readonly buffer AffectedTiles {
    uvec2 affected_tiles[];
};
layout(std430, set = 1, binding = 5) restrict writeonly buffer GroupSums { uint group_sums[]; };

#include "gi/voxel_cones/svo/dynamic_children.glsl"

shared uint total;

void main() {
    if (gl_LocalInvocationIndex == 0u) total = 0u;
    barrier();
    Level level = levels[params.level];
    uint group = linear_group(gl_WorkGroupID), count = 0u;
    for (uint i = 0u; i < TILES_PER_THREAD; ++i) {
        uint index = TILES_PER_GROUP * group + 64u * i + gl_LocalInvocationIndex,
             slot = dynamic_slot(level.first + index, params.first_dynamic);
        if (index < level.count && slot < params.capacity)
            count += uint(bitCount(dynamic_children(slot, static_word(slot))));
    }
    atomicAdd(total, count);
    barrier();
    if (gl_LocalInvocationIndex == 0u && group < uint(group_sums.length()))
        group_sums[group] = total;
}
