#version 460
#extension GL_GOOGLE_include_directive : require
// voxel.scan_groups: group sums to group bases, in one workgroup; the total is the number of
// occupied voxels.
layout(local_size_x = 256) in;

#include "shared/prefix_sum.glsl"

layout(std430, set = 1, binding = 0) restrict buffer GroupSums { uint group_sums[]; };
layout(std430, set = 1, binding = 1) restrict buffer Counters {
    uint fragment_count;
    uint voxel_count;
};

layout(push_constant) uniform ScanParams { uint group_count; } params;

void main() {
    uint base = 0u;
    for (uint first = 0u; first < params.group_count; first += 256u) {
        uint group = first + gl_LocalInvocationIndex;
        uint total;
        uint before =
            workgroup_prefix_sum(group < params.group_count ? group_sums[group] : 0u, total);
        if (group < params.group_count) group_sums[group] = base + before;
        base += total;
    }
    if (gl_LocalInvocationIndex == 0u) voxel_count = base;
}
