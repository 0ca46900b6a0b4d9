#version 460
#extension GL_GOOGLE_include_directive : require
// svo.scan_nodes: sums of 256 tiles to the number of flagged nodes before each 256, in one workgroup; the total makes the next finer level.
layout(local_size_x = 256) in;

#include "shared/prefix_sum.glsl"
#include "gi/svo/pool.glsl"

layout(std430, set = 1, binding = 0) restrict buffer GroupSums { uint group_sums[]; };
layout(std430, set = 1, binding = 1) restrict buffer Levels { Level levels[]; };

layout(push_constant) uniform LevelParams { uint level; uint first_free; } params;   // no tile before first_free is given away

void main() {
    Level level = levels[params.level];
    uint base = 0u, group_count = min((level.count + 255u) / 256u, uint(group_sums.length()));
    for (uint first = 0u; first < group_count; first += 256u) {
        uint group = first + gl_LocalInvocationIndex;
        uint total;
        uint before = workgroup_prefix_sum(group < group_count ? group_sums[group] : 0u, total);
        if (group < group_count) group_sums[group] = base + before;
        base += total;
    }
    if (gl_LocalInvocationIndex == 0u) {
        uint groups = (base + 255u) / 256u;
        uint first = max(level.first + level.count, params.first_free);
        levels[params.level - 1u] = Level(first, base, min(groups, 65535u), (groups + 65534u) / 65535u, 1u);
    }
}
