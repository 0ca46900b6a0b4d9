#version 460
#extension GL_GOOGLE_include_directive : require
// lpv.faces, lpv.nearest and lpv.surfaces: vertex pulling, orthographic along one axis. A pixel is
// a row of cells of the box.
#include "shared/frame.glsl"
#include "gi/lpv/box.glsl"

layout(location = 0) flat out uint triangle_index;

void main() {
    triangle_index = gl_VertexIndex / 3;
    uint corner = triangles[triangle_index][gl_VertexIndex % 3];
    vec3 position = turned(lattice_position(corner) - vec3(params.grid.first.xyz + params.low.xyz));
    // Powers of two, so that no rounding tells where the box is.
    ivec2 extent = ivec2(1) << (findMSB(turned(params.size.xyz).xy - 1) + 1);
    gl_Position = vec4(2.0 * position.xy / vec2(extent) - 1.0, 0.5, 1.0);
}
