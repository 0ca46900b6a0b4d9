#version 460
#extension GL_GOOGLE_include_directive : require
// svo.scan_nodes: sums of groups of tiles to the number of flagged nodes before each group, in one
// workgroup; the total makes the next finer level.
layout(local_size_x = 256) in;

#include "shared/prefix_sum.glsl"
#include "gi/voxel_cones/svo/pool.glsl"

layout(std430, set = 1, binding = 0) restrict buffer GroupSums { uint group_sums[]; };
layout(std430, set = 1, binding = 1) restrict buffer Levels { Level levels[]; };

// no tile before first_child is given away
layout(push_constant) uniform LevelParams { uint level; uint first_child; } params;

void main() {
    Level level = levels[params.level];
    uint base = 0u,
         group_count =
             min((level.count + TILES_PER_GROUP - 1u) / TILES_PER_GROUP, uint(group_sums.length()));
    for (uint first = 0u; first < group_count; first += 256u) {
        uint group = first + gl_LocalInvocationIndex;
        uint total;
        uint before = workgroup_prefix_sum(group < group_count ? group_sums[group] : 0u, total);
        if (group < group_count) group_sums[group] = base + before;
        base += total;
    }
    if (gl_LocalInvocationIndex == 0u) {
        uint groups = (base + TILES_PER_GROUP - 1u) / TILES_PER_GROUP;
        uint first = max(level.first + level.count, params.first_child);
        levels[params.level - 1u] =
            Level(first, base, min(groups, 65535u), (groups + 65534u) / 65535u, 1u);
    }
}
