#version 460
#extension GL_GOOGLE_include_directive : require
// render.shadow_maps and render.rsm: vertex pulling, one light view, by
// corners (shared/frame.glsl).
#include "shared/light_view.glsl"

layout(std430, set = 1, binding = 0) readonly buffer LightViews { LightView light_views[]; };

layout(push_constant) uniform ViewParams { uint view; } params;

layout(location = 0) out vec3 position_ws;
layout(location = 1) out vec2 uv;
layout(location = 2) flat out uint material;

void main() {
    uint vertex = vertex_of_corner(uint(gl_VertexIndex));
    position_ws = position_of(vertex);
    uv = texture_uv(vertex);
    material = triangle_materials[gl_VertexIndex];
    gl_Position = light_views[params.view].clip_from_world * vec4(position_ws, 1.0);
}
