#version 460
#extension GL_GOOGLE_include_directive : require
// lpv.peel: the nearest surface behind those of the layer before (depth peeling, Everitt 2001).
#include "shared/frame.glsl"
#include "shared/material.glsl"
#include "shared/packing.glsl"

layout(set = 1, binding = 0) uniform texture2D before;   // view depth [m]; 0: no surface

layout(push_constant) uniform PeelParams {
    uint is_first;   // there is no layer before
} params;

layout(location = 0) in vec3 position_ws;
layout(location = 2) in vec2 uv;
layout(location = 3) flat in uint triangle_index;

layout(location = 0) out float view_depth_m;
layout(location = 1) out uint normal;   // geometric, on the viewer's side; octahedral

// Surfaces nearer to each other than this share of their depth are one: rounding does not make a
// layer of its own.
const float SAME = 1e-5;

void main() {
    uvec3 triangle = vertices_of(triangle_index);
    if (materials[triangle_materials[triangle_index]].albedo.w > 0.0
        && texture(sampler2D(mask_texture, linear_repeat), uv).r < 0.5)
        discard;
    vec3 from_eye = position_ws - frame.eye_ws.xyz;
    view_depth_m = dot(from_eye, frame.ray_forward.xyz);
    if (params.is_first == 0u) {
        float nearer =
            texelFetch(sampler2D(before, nearest_clamp), ivec2(gl_FragCoord.xy), 0).r;
        if (nearer <= 0.0 || view_depth_m <= nearer * (1.0 + SAME)) discard;
    }
    vec3 a = position_of(triangle.x);
    vec3 geometric = normalize(
        cross(position_of(triangle.y) - a, position_of(triangle.z) - a));
    normal = pack_unit(dot(geometric, from_eye) <= 0.0 ? geometric : -geometric);
}
