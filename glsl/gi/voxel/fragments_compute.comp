#version 460
#extension GL_GOOGLE_include_directive : require
// voxel.fragments, method `compute`: a workgroup takes 64 triangles and spreads all their columns evenly over its threads, so that large and small
// triangles cost what their area costs. gl_NumWorkGroups.y workgroups share the columns of the same 64 triangles.
//
// Most columns of a bounding box are not touched, so testing and emitting take turns: threads test columns and queue what is touched, then all
// threads empty the queue. Emitting, the dearer half, so runs with all lanes busy.
layout(local_size_x = 64) in;

#include "gi/voxel/emit.glsl"

const uint COLUMNS_A_TURN = 256u;   // of the workgroup
const uint VOXELS_A_COLUMN = 4u;    // the dominant axis keeps slopes within 1, so a column holds no more
const uint TRIANGLE_BITS = 6u;

shared uint column_ends[64];
shared uint queue_size;
shared uvec2 queue[COLUMNS_A_TURN * VOXELS_A_COLUMN];   // x: column x, 16 bits, y, 16 bits; y: z and triangle

uint column_count(uint triangle) {
    TriangleSetup s;
    Attributes attributes;
    if (triangle >= params.triangle_count || !fetch_triangle(params.first_triangle + triangle, s, attributes)) return 0u;
    ivec2 size = max(s.high.xy - s.low.xy + 1, ivec2(0));
    return uint(size.x * size.y);
}

void count_columns(uint thread, uint first) {
    column_ends[thread] = column_count(first + thread);
    for (uint step = 1u; step < 64u; step <<= 1) {
        barrier();
        uint before = thread >= step ? column_ends[thread - step] : 0u;
        barrier();
        column_ends[thread] += before;
    }
    barrier();
}

// Queues the touched voxels of one column of one of the 64 triangles.
void test_column(uint first, uint item) {
    uint triangle = 0u;
    for (uint half_size = 32u; half_size > 0u; half_size >>= 1) {
        if (column_ends[triangle + half_size - 1u] <= item) triangle += half_size;
    }
    uint index = triangle == 0u ? item : item - column_ends[triangle - 1u];
    TriangleSetup s;
    Attributes attributes;
    if (!fetch_triangle(params.first_triangle + first + triangle, s, attributes)) return;
    int width = s.high.x - s.low.x + 1;
    ivec2 column = s.low.xy + ivec2(int(index) % width, int(index) / width);
    if (!touches_column(s, column)) return;
    ivec2 range = depth_range(s, column);
    for (int z = range.x; z <= range.y; ++z) {
        if (!touches(s, ivec3(column, z))) continue;
        ivec3 voxel = ivec3(column, z) - s.low;
        queue[atomicAdd(queue_size, 1u)] = uvec2(voxel.x | voxel.y << 16, uint(voxel.z) << TRIANGLE_BITS | triangle);
    }
}

void main() {
    uint thread = gl_LocalInvocationID.x;
    uint first = gl_WorkGroupID.x * 64u;
    count_columns(thread, first);
    uint total = column_ends[63];
    for (uint turn = gl_WorkGroupID.y * COLUMNS_A_TURN; turn < total; turn += COLUMNS_A_TURN * gl_NumWorkGroups.y) {
        if (thread == 0u) queue_size = 0u;
        barrier();
        for (uint item = turn + thread; item < min(turn + COLUMNS_A_TURN, total); item += 64u) test_column(first, item);
        barrier();
        for (uint slot = thread; slot < queue_size; slot += 64u) {
            uvec2 entry = queue[slot];
            TriangleSetup s;
            Attributes attributes;
            if (!fetch_triangle(params.first_triangle + first + (entry.y & ((1u << TRIANGLE_BITS) - 1u)), s, attributes)) continue;
            emit_fragment(s, s.low + ivec3(entry.x & 0xffffu, entry.x >> 16, entry.y >> TRIANGLE_BITS), attributes);
        }
        barrier();
    }
}
