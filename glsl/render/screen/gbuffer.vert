#version 460
#extension GL_GOOGLE_include_directive : require
// render.gbuffer: vertex pulling, by corners (shared/frame.glsl).
#include "shared/frame.glsl"

layout(location = 0) out vec3 position_ws;
layout(location = 1) out vec3 normal_ws;
layout(location = 2) out vec2 uv;
layout(location = 3) flat out uint triangle_index;
#ifdef MOTION
#include "render/screen/motion.glsl"
// Precise, so that what has not moved comes out the same to the bit.
layout(location = 4) precise out vec4 clip;
layout(location = 5) precise out vec4 previous_clip;
#endif

void main() {
    triangle_index = uint(gl_VertexIndex);
    uint vertex = vertex_of_corner(triangle_index);
    position_ws = position_of(vertex);
    normal_ws = shading_normal_of(vertex);
    uv = texture_uv(vertex);
    gl_Position = frame.clip_from_world * vec4(position_ws, 1.0);
#ifdef MOTION
    clip = frame.clip_from_world * vec4(position_ws, 1.0);
    previous_clip = before.has_previous != 0u
        ? before.previous_clip_from_world * vec4(previous_position(vertex, position_ws), 1.0)
        : clip;
#endif
}
