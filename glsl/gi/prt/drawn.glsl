// What prt.points and prt.marks_view know of a pixel: the cell of points that it shows.
#ifndef LUMIVOX_PRT_DRAWN
#define LUMIVOX_PRT_DRAWN

#include "shared/frame.glsl"
#include "shared/material.glsl"
#include "gi/prt/lattice.glsl"

layout(location = 0) in vec3 position_ws;
layout(location = 1) in vec2 uv;
layout(location = 2) in vec2 at;
layout(location = 3) flat in uint triangle_index;

// x, y: first node of the front and of the back; z: cells along an edge
layout(std430, set = 1, binding = 0) restrict readonly buffer TriangleNodes {
    uvec4 triangle_nodes[];
};
layout(std430, set = 1, binding = 1) restrict readonly buffer NodePoints { uint node_points[]; };

// Whether the mask leaves nothing of it.
bool is_cut() {
    Material m = materials[triangle_materials[triangle_index]];
    return m.albedo.w > 0.0 && texture(sampler2D(mask_texture, linear_repeat), uv).r < 0.5;
}

// The three points around it on the side that is seen, and their shares; false where that side has
// none.
bool find_points(out uvec3 points, out vec3 shares) {
    uvec3 v = vertices_of(triangle_index);
    vec3 a = position_of(v.x);
    vec3 normal = cross(position_of(v.y) - a, position_of(v.z) - a);
    bool is_front = dot(normal, frame.eye_ws.xyz - position_ws) >= 0.0;
    uvec4 nodes = triangle_nodes[triangle_index];
    uint first = is_front ? nodes.x : nodes.y;
    points = uvec3(0u);
    shares = vec3(0.0);
    if (first == NO_NODES) return false;
    LatticeCell cell = cell_at(nodes.z, at);
    for (int i = 0; i < 3; ++i) points[i] = node_points[first + cell.nodes[i]];
    shares = cell.shares;
    return true;
}

#endif
