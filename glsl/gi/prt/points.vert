#version 460
#extension GL_GOOGLE_include_directive : require
// prt.points: the scene's triangles once more, each pixel with its place in one.
#include "shared/frame.glsl"

layout(location = 0) out vec3 position_ws;
layout(location = 1) out vec2 uv;
layout(location = 2) out vec2 at;              // barycentric: of the second and third corner
layout(location = 3) flat out uint triangle_index;

void main() {
    triangle_index = uint(gl_VertexIndex) / 3u;
    uint corner = uint(gl_VertexIndex) % 3u;
    uint vertex = triangle_vertices[gl_VertexIndex];
    position_ws = position_of(vertex);
    uv = texture_uv(vertex);
    at = vec2(corner == 1u ? 1.0 : 0.0, corner == 2u ? 1.0 : 0.0);
    gl_Position = frame.clip_from_world * vec4(position_ws, 1.0);
}
