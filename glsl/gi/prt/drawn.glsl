// What prt.points, prt.cells and prt.marks_view know of a pixel: the cell of points that it shows.
#ifndef LUMIVOX_PRT_DRAWN
#define LUMIVOX_PRT_DRAWN

#include "shared/frame.glsl"
#include "shared/material.glsl"
#include "gi/prt/lattice.glsl"

layout(location = 0) in vec3 position_ws;
layout(location = 1) in vec2 uv;
layout(location = 2) in vec2 at;
layout(location = 3) flat in uint triangle_index;

// Whether the mask leaves nothing of it.
bool is_cut() {
    Material m = materials[triangle_materials[triangle_index]];
    return m.albedo.w > 0.0 && texture(sampler2D(mask_texture, linear_repeat), uv).r < 0.5;
}

// Whether its front is seen.
bool is_front_seen() {
    uvec3 v = vertices_of(triangle_index);
    vec3 a = position_of(v.x);
    vec3 normal = cross(position_of(v.y) - a, position_of(v.z) - a);
    return dot(normal, frame.eye_ws.xyz - position_ws) >= 0.0;
}

// The three points around it on the side that is seen, and their shares; false where that side has
// none.
bool find_points(out uvec3 points, out vec3 shares) {
    return points_around(triangle_index, is_front_seen(), at, points, shares);
}

#endif
