#version 460
#extension GL_GOOGLE_include_directive : require
// voxel.fragments, method `compute`: a workgroup takes 64 triangles and spreads all their columns evenly over its threads,
// so that large and small triangles cost what their area costs. gl_NumWorkGroups.y workgroups share the columns of the same 64 triangles.
layout(local_size_x = 64) in;

#include "gi/voxel/emit.glsl"

shared uint column_ends[64];

uint column_count(uint triangle) {
    TriangleSetup s;
    Attributes attributes;
    if (triangle >= params.triangle_count || !fetch_triangle(params.first_triangle + triangle, s, attributes)) return 0u;
    ivec2 size = max(s.high.xy - s.low.xy + 1, ivec2(0));
    return uint(size.x * size.y);
}

void main() {
    uint thread = gl_LocalInvocationID.x;
    uint first = gl_WorkGroupID.x * 64u;
    column_ends[thread] = column_count(first + thread);
    for (uint step = 1u; step < 64u; step <<= 1) {
        barrier();
        uint before = thread >= step ? column_ends[thread - step] : 0u;
        barrier();
        column_ends[thread] += before;
    }
    barrier();
    uint total = column_ends[63];
    for (uint item = gl_WorkGroupID.y * 64u + thread; item < total; item += 64u * gl_NumWorkGroups.y) {
        uint triangle = 0u;
        for (uint half_size = 32u; half_size > 0u; half_size >>= 1) {
            if (column_ends[triangle + half_size - 1u] <= item) triangle += half_size;
        }
        uint column = triangle == 0u ? item : item - column_ends[triangle - 1u];
        TriangleSetup s;
        Attributes attributes;
        if (fetch_triangle(params.first_triangle + first + triangle, s, attributes)) {
            int width = s.high.x - s.low.x + 1;
            voxelize_column(s, s.low.xy + ivec2(int(column) % width, int(column) / width), attributes);
        }
    }
}
