#version 460
#extension GL_GOOGLE_include_directive : require
// voxel.scan_touched: sums of groups to sums before each group, in one workgroup; the totals are
// the number of touched blocks and of voxels in them. Where something did not fit, all is counted
// again, and blocks stay what they were.
layout(local_size_x = 256) in;

#include "shared/prefix_sum.glsl"
#include "gi/shared/voxel/dynamic/touched.glsl"

layout(std430, set = 1, binding = 0) restrict buffer TouchedSums { uvec2 touched_sums[]; };
layout(std430, set = 1, binding = 1) restrict buffer TouchedCounts { TouchedCounters counts; };

layout(push_constant) uniform TouchedScanParams {
    uint touched_groups;
    uint fragment_room;
    uint touched_room;
} params;

void main() {
    uvec2 base = uvec2(0u);
    for (uint first = 0u; first < params.touched_groups; first += 256u) {
        uint group = first + gl_LocalInvocationIndex;
        uvec2 sums = group < params.touched_groups ? touched_sums[group] : uvec2(0u);
        uvec2 total, before;
        before.x = workgroup_prefix_sum(sums.x, total.x);
        before.y = workgroup_prefix_sum(sums.y, total.y);
        if (group < params.touched_groups) touched_sums[group] = base + before;
        base += total;
    }
    if (gl_LocalInvocationIndex == 0u) {
        counts.touched_count = base.x;
        counts.slot_count = base.y;
        counts.indexed = uint(counts.unfinished_count == 0u
            && counts.fragment_count <= params.fragment_room && base.x <= params.touched_room);
    }
}
