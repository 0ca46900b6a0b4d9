// The points at the nodes of triangles (Rust: prt::lattice).
#ifndef LUMIVOX_PRT_LATTICE
#define LUMIVOX_PRT_LATTICE

const uint NO_NODES = 0xffffffffu;

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

#endif
