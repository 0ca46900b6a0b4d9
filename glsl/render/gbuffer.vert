#version 460
#extension GL_GOOGLE_include_directive : require
// render.gbuffer: vertex pulling.
#include "shared/frame.glsl"

layout(location = 0) out vec3 position_ws;
layout(location = 1) out vec3 normal_ws;
layout(location = 2) out vec2 uv;
layout(location = 3) flat out uint triangle_index;

void main() {
    triangle_index = uint(gl_VertexIndex) / 3u;
    Vertex vertex = vertices[triangles[triangle_index][gl_VertexIndex % 3]];
    position_ws = vertex.position;
    normal_ws = vertex.normal;
    uv = texture_uv(vertex);
    gl_Position = frame.clip_from_world * vec4(position_ws, 1.0);
}
