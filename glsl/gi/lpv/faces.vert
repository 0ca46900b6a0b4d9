#version 460
#extension GL_GOOGLE_include_directive : require
// lpv.faces, lpv.nearest and lpv.surfaces: vertex pulling, orthographic along one axis. A pixel is
// a row of cells.
#include "shared/frame.glsl"
#include "gi/lpv/grid.glsl"

layout(push_constant) uniform FacesParams {
    CellGrid grid;
    uint axis;
} params;

layout(location = 0) out float depth;   // along the axis, 0 at the first cell's centre [cells]
layout(location = 1) out vec2 uv;
layout(location = 2) flat out uint triangle_index;
layout(location = 3) flat out vec3 normal;   // of the front, not of unit length

void main() {
    triangle_index = gl_VertexIndex / 3;
    uvec4 triangle = triangles[triangle_index];
    Vertex vertex = vertices[triangle[gl_VertexIndex % 3]];
    vec3 position = to_cells(params.grid, vertex.position);
    vec3 turned = params.axis == 0u ? position.yzx : params.axis == 1u ? position.zxy : position;
    ivec3 size = params.grid.size.xyz;
    ivec2 across = params.axis == 0u ? size.yz : params.axis == 1u ? size.zx : size.xy;
    depth = turned.z - 0.5;
    uv = texture_uv(vertex);
    vec3 corner = vertices[triangle.x].position;
    normal = cross(vertices[triangle.y].position - corner, vertices[triangle.z].position - corner);
    gl_Position = vec4(2.0 * turned.xy / vec2(across) - 1.0, 0.5, 1.0);
}
