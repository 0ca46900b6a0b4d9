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
const uint STRIDE = 64u;   // between entries of a thread: each thread has a bank of its own

shared uint tile_ends[64];
// bits | x | y | z |: 3, 3 and 26 bits, x and y in the tile, z relative to s.base plus DEPTH_BIAS.
const int DEPTH_BIAS = 1;   // s.low.z is −1 or more
shared uint queue[STRIDE * QUEUE];

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
    barrier();
    uint sum = 0u;
    for (uint i = thread & ~7u; i <= thread; ++i) sum += tile_ends[i];
    barrier();
    tile_ends[thread] = sum;
    barrier();
    for (uint i = 7u; i < (thread & ~7u); i += 8u) sum += tile_ends[i];
    barrier();
    tile_ends[thread] = sum;
    barrier();
}

// The candidates of a tile, row by row, column by column, in depth.
struct Walk {
    int x, y, z;
    int last_x, last_z;       // of the row, of the column
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

uint queue_entry(ivec2 in_tile, int z) {
    return uint(in_tile.x) | uint(in_tile.y) << 3 | uint(z + DEPTH_BIAS) << 6;
}

// The voxel of an entry, in the tile that begins at `low`.
ivec3 queued_voxel(uint entry, ivec2 low) {
    return ivec3(low + ivec2(entry & 7u, entry >> 3 & 7u), int(entry >> 6) - DEPTH_BIAS);
}

// Some columns of one triangle, from `low` to `high`.
struct Tile {
    uint triangle;
    ivec2 low, high;
};

// Marks a voxel together with those before it that share its word: `marks` is the word and their
// bits, which go out when another word comes.
void mark_with(inout uvec2 marks, TriangleSetup s, ivec3 local_voxel) {
    uvec2 own = mark_of(uvec3(unpermute(s.base + local_voxel, s.axis)));
    if (own.x != marks.x) {
        atomicOr(occupancy[marks.x], marks.y);
        marks = uvec2(own.x, 0u);
    }
    marks.y |= own.y;
}

// Columns of the triangle whose fragments no edge cuts are marked and stored apart: they cost less.
// False where the driver ended a loop early.
bool voxelize_tile(uint thread, TriangleSetup s, Surface surface, Tile tile) {
    Walk at = Walk(tile.high.x, tile.low.y - 1, 0, tile.high.x, -1);
    uint bottom = thread, top = bottom + (QUEUE - 1u) * STRIDE;
    bool going = true;
    while (going) {
        uint cut = 0u, inner = 0u;
        while (going && cut + inner < QUEUE) {
            advance(at, s, tile.low, tile.high);
            going = at.y <= tile.high.y;
            ivec2 column = ivec2(at.x, at.y);
            if (going && at.z <= at.last_z && touches(s, ivec3(column, at.z))) {
                // What a mask leaves is found fragment by fragment.
                bool whole = MASKED == 0u && is_inner(s, column);
                uint free = whole ? top - STRIDE * inner : bottom + STRIDE * cut;
                queue[free] = queue_entry(column - tile.low, at.z);
                inner += uint(whole);
                cut += uint(!whole);
            }
        }
        uint slot = reserve(cut + inner), i, k;
        uvec2 marks = uvec2(0u);
        for (k = 0u; k < inner; ++k, ++slot) {
            ivec3 voxel = queued_voxel(queue[top - STRIDE * k], tile.low);
            mark_with(marks, s, voxel);
            place_fragment(s, surface, tile.triangle, voxel, slot, false);
        }
        for (i = 0u; i < cut; ++i, ++slot) {
            ivec3 voxel = queued_voxel(queue[bottom + STRIDE * i], tile.low);
            if (MASKED == 0u) mark_with(marks, s, voxel);
            place_fragment(s, surface, tile.triangle, voxel, slot, true);
        }
        atomicOr(occupancy[marks.x], marks.y);
        if (k < inner || i < cut) return false;
    }
    return !going;
}

// Tile number `item` of the workgroup. False where the driver ended a loop early.
bool voxelize_item(uint thread, uint first, uint item) {
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
    Tile tile = Tile(triangle, low, min(low + TILE - 1, s.high.xy));
    return voxelize_tile(thread, s, surface, tile);
}

void main() {
    uint thread = gl_LocalInvocationID.x;
    uint first = gl_WorkGroupID.x * 64u;
    count_tiles(thread, first);
    uint total = tile_ends[63], item;
    bool finished = true;
    for (item = gl_WorkGroupID.y * 64u + thread; item < total; item += 64u * gl_NumWorkGroups.y)
        finished = voxelize_item(thread, first, item) && finished;
    // llvmpipe ends loops after 65,535 turns in all: the host then shares the tiles among more
    // workgroups.
    if (!finished || item < total) atomicAdd(unfinished_count, 1u);
}
