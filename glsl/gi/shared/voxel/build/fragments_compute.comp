#version 460
#extension GL_GOOGLE_include_directive : require
// voxel.fragments, method `compute`: a workgroup takes 64 triangles, cuts their bounding boxes
// along the dominant axis into tiles of TILE² columns, and spreads the tiles evenly over its
// threads, so that large and small triangles cost what their area costs. gl_NumWorkGroups.y
// workgroups share the tiles of the same 64 triangles. A thread first finds the touched voxels of
// its tile, then emits them: an emission is dear and a voxel that is not touched is cheap, and
// threads that run in step wait for each other.
layout(local_size_x = 64) in;

#include "gi/shared/voxel/build/emit.glsl"

const int TILE = 8;
// voxels found before they are emitted: 12 KiB of shared memory a workgroup
const uint QUEUE = 48u;

shared uint tile_ends[64];
// bits | x | y | z |: 3, 3 and 26 bits, x and y in the tile, z relative to s.base plus DEPTH_BIAS.
const int DEPTH_BIAS = 1;   // s.low.z is −1 or more
shared uint queue[64u * QUEUE];

// Tiles in a row, and rows.
ivec2 tiles(TriangleSetup s) {
    return max(s.high.xy - s.low.xy + TILE, ivec2(0)) / TILE;
}

uint tile_count(uint triangle) {
    TriangleSetup s;
    if (triangle >= params.triangle_count || !fetch_triangle(params.first_triangle + triangle, s))
        return 0u;
    ivec2 count = tiles(s);
    return uint(count.x * count.y);
}

void count_tiles(uint thread, uint first) {
    tile_ends[thread] = tile_count(first + thread);
    for (uint step = 1u; step < 64u; step <<= 1) {
        barrier();
        uint before = thread >= step ? tile_ends[thread - step] : 0u;
        barrier();
        tile_ends[thread] += before;
    }
    barrier();
}

// The candidates of a tile, row by row, column by column, in depth.
struct Walk {
    int x, y, z;
    int last_x, last_z;   // of the row, of the column
};

// Steps to the next candidate; y is past `high` after the last one. Columns without candidates cost
// a step.
void advance(inout Walk at, TriangleSetup s, ivec2 low, ivec2 high) {
    ++at.z;
    if (at.z <= at.last_z) return;
    ++at.x;
    if (at.x > at.last_x) {
        ++at.y;
        ivec2 columns =
            clamp(row_range(s, at.y), ivec2(low.x, low.x - 1), ivec2(high.x + 1, high.x));
        at.x = columns.x;
        at.last_x = columns.y;
    }
    ivec2 depths = at.x <= at.last_x && touches_column(s, ivec2(at.x, at.y))
        ? depth_range(s, ivec2(at.x, at.y))
        : ivec2(0, -1);
    at.z = depths.x;
    at.last_z = depths.y;
}

// Tile number `item` of the workgroup. False where the driver ended a loop early.
bool voxelize_tile(uint thread, uint first, uint item) {
    uint triangle = 0u;
    for (uint half_size = 32u; half_size > 0u; half_size >>= 1) {
        if (tile_ends[triangle + half_size - 1u] <= item) triangle += half_size;
    }
    int index = int(triangle == 0u ? item : item - tile_ends[triangle - 1u]);
    triangle += params.first_triangle + first;
    TriangleSetup s;
    fetch_triangle(triangle, s);
    Surface surface = surface_of(s);
    int in_row = tiles(s).x;
    ivec2 low = s.low.xy + TILE * ivec2(index % in_row, index / in_row);
    ivec2 high = min(low + TILE - 1, s.high.xy);
    Walk at = Walk(high.x, low.y - 1, 0, high.x, -1);
    bool going = true;
    while (going) {
        uint count = 0u;
        while (going && count < QUEUE) {
            advance(at, s, low, high);
            going = at.y <= high.y;
            if (going && at.z <= at.last_z && touches(s, ivec3(at.x, at.y, at.z))) {
                queue[thread * QUEUE + count] =
                    uint(at.x - low.x) | uint(at.y - low.y) << 3 | uint(at.z + DEPTH_BIAS) << 6;
                ++count;
            }
        }
        uint slot = reserve(count), i;
        for (i = 0u; i < count; ++i) {
            uint entry = queue[thread * QUEUE + i];
            emit_fragment(s, surface, triangle,
                ivec3(low + ivec2(entry & 7u, entry >> 3 & 7u), int(entry >> 6) - DEPTH_BIAS),
                slot + i);
        }
        if (i < count) return false;
    }
    return !going;
}

void main() {
    uint thread = gl_LocalInvocationID.x;
    uint first = gl_WorkGroupID.x * 64u;
    count_tiles(thread, first);
    uint total = tile_ends[63], item;
    bool finished = true;
    for (item = gl_WorkGroupID.y * 64u + thread; item < total; item += 64u * gl_NumWorkGroups.y)
        finished = voxelize_tile(thread, first, item) && finished;
    // llvmpipe ends loops after 65,535 turns in all: the host then shares the tiles among more
    // workgroups.
    if (!finished || item < total) atomicAdd(unfinished_count, 1u);
}
