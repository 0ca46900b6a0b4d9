// A fragment of the rasterizations along an axis: where the segment between the centres of two
// cells meets a triangle.
#ifndef LUMIVOX_LPV_CROSSING
#define LUMIVOX_LPV_CROSSING

#include "shared/frame.glsl"
#include "shared/material.glsl"
#include "gi/lpv/box.glsl"

layout(location = 0) flat in uint triangle_index;

// The two cells, the one's share of the segment, and the surface there.
struct Crossing {
    ivec3 low, high;
    float share;
    vec2 uv;
    vec3 normal;   // of the front, not of unit length
};

vec3 lattice_position(uint vertex) {
    return to_lattice(params.grid, position_of(vertex));
}

// Twice the area of the triangle from the origin to two points.
float doubled_area(vec2 a, vec2 b) {
    precise float area = a.x * b.y - a.y * b.x;
    return area;
}

// Leaves fragments in holes of a mask. Everything is of the triangle and of the row's place in the
// lattice: interpolated depths would tell where the box is.
Crossing find_crossing() {
    uvec3 triangle = vertices_of(triangle_index);
    vec3 a = lattice_position(triangle.x), to_b = lattice_position(triangle.y) - a,
         to_c = lattice_position(triangle.z) - a;
    vec3 from = turned(a), along_b = turned(to_b), along_c = turned(to_c);
    ivec2 row = ivec2(gl_FragCoord.xy);
    ivec3 first = turned(params.grid.first.xyz + params.low.xyz);
    vec2 place = vec2(first.xy + row) + 0.5 - from.xy;
    float area = doubled_area(along_b.xy, along_c.xy);
    float b = doubled_area(place, along_c.xy) / area, c = doubled_area(along_b.xy, place) / area;
    vec2 uv_a = texture_uv(triangle.x), uv_b = texture_uv(triangle.y),
         uv_c = texture_uv(triangle.z);
    vec2 uv = uv_a + b * (uv_b - uv_a) + c * (uv_c - uv_a);
    if (materials[triangle_materials[triangle_index]].albedo.w > 0.0
        && texture(sampler2D(mask_texture, linear_repeat), uv).r < 0.5)
        discard;
    precise float depth = from.z + b * along_b.z + c * along_c.z - 0.5;
    ivec3 cell = ivec3(row, int(floor(depth)) - first.z);
    uint axis = uint(params.low.w);
    ivec3 low = params.low.xyz + (axis == 0u ? cell.zxy : axis == 1u ? cell.yzx : cell);
    ivec3 high = low;
    high[axis] += 1;
    vec3 corner = position_of(triangle.x);
    vec3 normal = cross(
        position_of(triangle.y) - corner, position_of(triangle.z) - corner);
    return Crossing(low, high, depth - floor(depth), uv, normal);
}

#endif
