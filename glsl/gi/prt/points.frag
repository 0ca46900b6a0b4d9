#version 460
#extension GL_GOOGLE_include_directive : require
// prt.points: irradiance and ambient visibility of what each pixel shows, between points.
#include "shared/frame.glsl"
#include "shared/material.glsl"
#include "gi/prt/lattice.glsl"

layout(location = 0) in vec3 position_ws;
layout(location = 1) in vec2 uv;
layout(location = 2) in vec2 at;
layout(location = 3) flat in uint triangle_index;

layout(location = 0) out vec4 seen;   // rgb: irradiance [W/m²]; a: ambient visibility

layout(constant_id = 0) const uint CLAMP = 1;   // no negative irradiance

// x, y: first node of the front and of the back; z: cells along an edge
layout(std430, set = 1, binding = 0) restrict readonly buffer TriangleNodes {
    uvec4 triangle_nodes[];
};
layout(std430, set = 1, binding = 1) restrict readonly buffer NodePoints { uint node_points[]; };
layout(std430, set = 1, binding = 2) restrict readonly buffer PointLight { vec4 point_light[]; };

void main() {
    Material m = materials[triangle_materials[triangle_index]];
    bool is_cut =
        m.albedo.w > 0.0 && texture(sampler2D(mask_texture, linear_repeat), uv).r < 0.5;
    uvec3 v = vertices_of(triangle_index);
    vec3 a = position_of(v.x);
    vec3 normal = cross(position_of(v.y) - a, position_of(v.z) - a);
    bool is_front = dot(normal, frame.eye_ws.xyz - position_ws) >= 0.0;
    uvec4 nodes = triangle_nodes[triangle_index];
    uint first = is_front ? nodes.x : nodes.y;
    seen = vec4(0.0);
    if (first != NO_NODES) {
        LatticeCell cell = cell_at(nodes.z, at);
        for (int i = 0; i < 3; ++i)
            seen += cell.shares[i] * point_light[node_points[first + cell.nodes[i]]];
        if (CLAMP != 0u) seen.rgb = max(seen.rgb, vec3(0.0));
    }
    if (is_cut) discard;
}
