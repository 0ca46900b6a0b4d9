// The points at the nodes of triangles (Rust: prt::lattice).
#ifndef LUMIVOX_PRT_LATTICE
#define LUMIVOX_PRT_LATTICE

const uint NO_NODES = 0xffffffffu;

// x, y: first node of the front and of the back; z: cells along an edge
layout(std430, set = 1, binding = 0) restrict readonly buffer TriangleNodes {
    uvec4 triangle_nodes[];
};
layout(std430, set = 1, binding = 1) restrict readonly buffer NodePoints { uint node_points[]; };

// The node of a triangle that is `ij` cells towards its second and its third corner.
uint node_of(uint cells, uvec2 ij) {
    return ij.y * (2u * cells + 3u - ij.y) / 2u + ij.x;
}

struct LatticeCell {
    uvec3 nodes;
    vec3 shares;
};

// The three nodes around barycentric coordinates of a triangle.
LatticeCell cell_at(uint cells, vec2 at) {
    vec2 place = clamp(at * float(cells), vec2(0.0), vec2(cells));
    // The last cell along a row may be a half one: it has a lower triangle alone.
    uint j = min(uint(place.y), cells - 1u);
    uint i = min(uint(place.x), cells - 1u - j);
    vec2 part = place - vec2(i, j);
    if (part.x + part.y <= 1.0 || i + j + 2u > cells) {
        part = clamp(part, vec2(0.0), vec2(1.0));
        vec3 shares = vec3(max(1.0 - part.x - part.y, 0.0), part);
        return LatticeCell(uvec3(node_of(cells, uvec2(i, j)), node_of(cells, uvec2(i + 1u, j)),
                               node_of(cells, uvec2(i, j + 1u))),
            shares / (shares.x + shares.y + shares.z));
    }
    uint upper = node_of(cells, uvec2(i + 1u, j + 1u));
    return LatticeCell(
        uvec3(node_of(cells, uvec2(i + 1u, j)), upper, node_of(cells, uvec2(i, j + 1u))),
        vec3(1.0 - part.y, part.x + part.y - 1.0, 1.0 - part.x));
}

// The three points around a place of a side of a triangle, and their shares; false where that side
// has none.
bool points_around(uint triangle, bool is_front, vec2 at, out uvec3 points, out vec3 shares) {
    uvec4 nodes = triangle_nodes[triangle];
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
