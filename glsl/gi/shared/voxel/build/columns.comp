#version 460
#extension GL_GOOGLE_include_directive : require
// voxel.columns: which voxels of each column along an axis lie inside of a body: between a surface
// that looks back along the column and the next, which looks ahead. A room, whose walls look into
// it, is no body.
layout(local_size_x = 8, local_size_y = 8) in;

#include "render/bvh/bindings.glsl"

// a bit a voxel: words of a column, columns of a slice, slices of an axis, axes
layout(std430, set = 1, binding = 5) restrict buffer Inside { uint inside[]; };

layout(push_constant) uniform ColumnParams {
    vec4 origin_size;   // xyz: smallest corner of the grid [m]; w: edge of a voxel [m]
    uint axis;
    uint resolution;    // voxels along an edge
    // first and last voxel that is asked for, 16 bits each, along x, y, z
    uint clip_x, clip_y, clip_z;
    float start;        // along the axis, before all surfaces [m]
} params;

#include "shared/frame.glsl"
#include "render/bvh/traverse.glsl"
#include "gi/shared/voxel/build/inside.glsl"

// Surfaces that a column may meet; what lies behind them is outside.
const uint MOST_SURFACES = 48u;
// Off the middles of voxels [voxels]: a ray may pass between two triangles along their common edge,
// and edges often go through middles (Rust: oracle::COLUMN_OFFSET).
const vec2 OFFSET = vec2(0.0137, -0.0071);
// Surfaces that are nearer to each other are at one place [voxels].
const float SAME = 2e-4;

void fill(uvec2 column, uint first, uint end) {
    while (first < end) {
        uint bit = first & 31u, count = min(32u - bit, end - first);
        uint bits = count == 32u ? 0xffffffffu : (1u << count) - 1u;
        inside[word_of(params.axis, column, first, params.resolution)] |= bits << bit;
        first += count;
    }
}

// The first voxel of a range whose middle is behind a place along the axis [voxels].
uint first_behind(float place, uvec2 range) {
    return uint(clamp(ceil(place - 0.5), float(range.x), float(range.y)));
}

// Whether a triangle looks ahead along the axis.
bool looks_ahead(uint triangle, uint axis) {
    uvec3 v = vertices_of(triangle);
    vec3 a = position_of(v.x);
    return cross(position_of(v.y) - a, position_of(v.z) - a)[axis] > 0.0;
}

// Whether two triangles have the same corners.
bool is_twin(uint one, uint other) {
    uvec3 v = vertices_of(one), w = vertices_of(other);
    for (int i = 0; i < 3; ++i) {
        vec3 corner = position_of(v[i]);
        if (corner != position_of(w.x) && corner != position_of(w.y) && corner != position_of(w.z))
            return false;
    }
    return true;
}

void main() {
    uvec3 clip = uvec3(params.clip_x, params.clip_y, params.clip_z);
    uint axis = params.axis, across = (axis + 1u) % 3u, up = (axis + 2u) % 3u;
    uvec2 column = gl_GlobalInvocationID.xy + uvec2(clip[across] & 0xffffu, clip[up] & 0xffffu);
    if (column.x > clip[across] >> 16 || column.y > clip[up] >> 16) return;
    uvec2 range = uvec2(clip[axis] & 0xffffu, (clip[axis] >> 16) + 1u);
    vec3 origin = params.origin_size.xyz, direction = vec3(0.0);
    float size = params.origin_size.w, base = origin[axis];
    vec2 middle = vec2(column) + 0.5 + OFFSET;
    origin[across] += size * middle.x;
    origin[up] += size * middle.y;
    origin[axis] = params.start;
    direction[axis] = 1.0;
    // Surfaces at one place: whether any looks back or ahead, and the first of them.
    float place = -1e9;
    bool begins = false, ends = false, is_sheet = false;
    uint leaves = NO_TRIANGLE;
    // The body that the column is in.
    bool is_inside = false;
    float entered = 0.0;
    for (uint i = 0u; i < MOST_SURFACES; ++i) {
        RayHit hit = closest_hit(origin, direction, leaves);
        bool is_end = hit.triangle == NO_TRIANGLE, is_back = false;
        float met = 1e9;
        if (!is_end) {
            met = (origin[axis] + hit.t - base) / size;
            is_back = looks_ahead(hit.triangle, axis);
        }
        if (met <= place + SAME) {
            is_sheet = is_twin(leaves, hit.triangle);
            begins = begins || !is_back;
            ends = ends || is_back;
            origin[axis] = base + (place + SAME) * size;
        } else {
            // A sheet of two sides bounds nothing.
            if (!is_sheet) {
                if (ends && is_inside)
                    fill(column, first_behind(entered, range), first_behind(place, range));
                is_inside = begins;
                entered = place;
            }
            if (is_end || place >= float(range.y)) break;
            place = met;
            begins = !is_back;
            ends = is_back;
            is_sheet = false;
            origin[axis] = base + (place - 0.5 * SAME) * size;
        }
        leaves = hit.triangle;
    }
}
