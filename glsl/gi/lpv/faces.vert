#version 460
#extension GL_GOOGLE_include_directive : require
// lpv.faces, lpv.nearest and lpv.surfaces: vertex pulling, orthographic along one axis. A pixel is
// a row of cells of the box.
#include "shared/frame.glsl"
#include "gi/lpv/box.glsl"

layout(location = 0) flat out uint triangle_index;

// Positions are rounded to so many grains of a cell: whole cells from them are then exact, wherever
// in the lattice the box is. Rasterizers round to as many, and to a side that depends on the place
// where a position is halfway between two.
const float GRAINS = 256.0;
const float VIEWPORT = 4096.0;   // edge [px], the box in its middle; Rust: VIEWPORT of lpv::faces

void main() {
    triangle_index = gl_VertexIndex / 3;
    vec3 lattice = to_lattice(params.grid, position_of(triangle_vertices[gl_VertexIndex]));
    vec3 position = round(lattice * GRAINS) / GRAINS
        - vec3(params.grid.first.xyz + params.low.xyz) - 0.5 * vec3(params.size.xyz);
    gl_Position = vec4(turned(position).xy / (0.5 * VIEWPORT), 0.5, 1.0);
}
