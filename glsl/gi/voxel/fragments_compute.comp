#version 460
#extension GL_GOOGLE_include_directive : require
// voxel.fragments, method `compute`: a workgroup takes 64 triangles, cuts their bounding boxes along the dominant axis into runs of at most RUN columns
// of one row, and spreads the runs evenly over its threads, so that large and small triangles cost what their area costs. gl_NumWorkGroups.y workgroups
// share the runs of the same 64 triangles.
layout(local_size_x = 64) in;

#include "gi/voxel/emit.glsl"

const int RUN = 8;

shared uint run_ends[64];

// Runs in a row, and rows.
ivec2 runs(TriangleSetup s) {
    ivec2 size = max(s.high.xy - s.low.xy + 1, ivec2(0));
    return ivec2((size.x + RUN - 1) / RUN, size.y);
}

uint run_count(uint triangle) {
    TriangleSetup s;
    if (triangle >= params.triangle_count || !fetch_triangle(params.first_triangle + triangle, s)) return 0u;
    ivec2 count = runs(s);
    return uint(count.x * count.y);
}

void count_runs(uint thread, uint first) {
    run_ends[thread] = run_count(first + thread);
    for (uint step = 1u; step < 64u; step <<= 1) {
        barrier();
        uint before = thread >= step ? run_ends[thread - step] : 0u;
        barrier();
        run_ends[thread] += before;
    }
    barrier();
}

void voxelize_run(uint first, uint item) {
    uint triangle = 0u;
    for (uint half_size = 32u; half_size > 0u; half_size >>= 1) {
        if (run_ends[triangle + half_size - 1u] <= item) triangle += half_size;
    }
    int index = int(triangle == 0u ? item : item - run_ends[triangle - 1u]);
    TriangleSetup s;
    if (!fetch_triangle(params.first_triangle + first + triangle, s)) return;
    int in_row = runs(s).x;
    int row = s.low.y + index / in_row, start = s.low.x + index % in_row * RUN;
    ivec2 columns = clamp(row_range(s, row), ivec2(start, start - 1), ivec2(start + RUN, start + RUN - 1));
    for (int x = columns.x; x <= columns.y; ++x) voxelize_column(s, params.first_triangle + first + triangle, ivec2(x, row));
}

void main() {
    uint thread = gl_LocalInvocationID.x;
    uint first = gl_WorkGroupID.x * 64u;
    count_runs(thread, first);
    uint total = run_ends[63];
    for (uint item = gl_WorkGroupID.y * 64u + thread; item < total; item += 64u * gl_NumWorkGroups.y) voxelize_run(first, item);
}
