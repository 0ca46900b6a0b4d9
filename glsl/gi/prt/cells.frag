#version 460
#extension GL_GOOGLE_include_directive : require
// prt.cells: where each pixel is on which triangle, for passes that read points themselves.
#include "gi/prt/drawn.glsl"
#include "shared/packing.glsl"

// x: 1 + 2 × triangle, + 1 of its back; 0: nothing. y, z: barycentric, of the second and third
// corner. w: normal between those of the corners, not bumped.
layout(location = 0) out uvec4 cell;

void main() {
    bool is_gone = is_cut(), is_front = is_front_seen();
    uvec3 v = vertices_of(triangle_index);
    vec3 a = position_of(v.x);
    vec3 front = cross(position_of(v.y) - a, position_of(v.z) - a);
    vec3 normal = (1.0 - at.x - at.y) * shading_normal_of(v.x) + at.x * shading_normal_of(v.y)
        + at.y * shading_normal_of(v.z);
    bool is_turned = (dot(normal, front) >= 0.0) != is_front;
    normal = normalize(is_turned ? -normal : normal);
    cell = uvec4(1u + 2u * triangle_index + (is_front ? 0u : 1u), floatBitsToUint(at),
        pack_unit(normal));
    if (is_gone) discard;
}
