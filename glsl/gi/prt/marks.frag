#version 460
#extension GL_GOOGLE_include_directive : require
// prt.marks: which point each pixel shows most, or the cluster of that point, each in its own
// colour.
#include "shared/frame.glsl"
#include "shared/material.glsl"
#include "gi/prt/lattice.glsl"

layout(location = 0) in vec3 position_ws;
layout(location = 1) in vec2 uv;
layout(location = 2) in vec2 at;
layout(location = 3) flat in uint triangle_index;

layout(location = 0) out vec4 seen;

layout(constant_id = 0) const uint CLUSTERS = 0;   // of points

// x, y: first node of the front and of the back; z: cells along an edge
layout(std430, set = 1, binding = 0) restrict readonly buffer TriangleNodes {
    uvec4 triangle_nodes[];
};
layout(std430, set = 1, binding = 1) restrict readonly buffer NodePoints { uint node_points[]; };
// four points a word
layout(std430, set = 1, binding = 2) restrict readonly buffer Clusters { uint point_clusters[]; };

// Bright, and unlike that of the next number.
vec3 color_of(uint number) {
    uint hash = (number + 1u) * 0x9e3779b9u;
    hash = (hash ^ hash >> 15) * 0x85ebca6bu;
    hash ^= hash >> 13;
    return 0.25 + 0.75 * vec3(hash & 0xffu, hash >> 8 & 0xffu, hash >> 16 & 0xffu) / 255.0;
}

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
        bvec3 is_most = greaterThanEqual(cell.shares, vec3(max(cell.shares.x,
            max(cell.shares.y, cell.shares.z))));
        uint node = is_most.x ? cell.nodes.x : is_most.y ? cell.nodes.y : cell.nodes.z;
        uint number = node_points[first + node];
        if (CLUSTERS != 0u)
            number = bitfieldExtract(point_clusters[number / 4u], int(number % 4u) * 8, 8);
        seen = vec4(color_of(number), 1.0);
    }
    if (is_cut) discard;
}
