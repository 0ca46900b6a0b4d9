#version 460
#extension GL_GOOGLE_include_directive : require
// render.shadow_maps and render.rsm of a cascade. What a texel sees depends on where it lies in the
// scene alone, not on where the map begins: corners lie on a grid of 1/256 texel that is counted
// from the anchor, as rasterization has it, and depth is that of the triangle's plane, counted from
// a corner of it.
#include "shared/light_view.glsl"

layout(std430, set = 1, binding = 0) readonly buffer LightViews { LightView light_views[]; };

layout(push_constant) uniform ViewParams { uint view; } params;

layout(location = 0) out vec3 position_ws;
layout(location = 1) out vec2 uv;
layout(location = 2) flat out uint material;
// A corner [texels] and its depth, and how much depth changes along the longest edge from there.
layout(location = 3) flat out vec4 plane_start;
// The longest edge and the height on it, over their squares [1/texel].
layout(location = 4) flat out vec4 plane_axes;
// x: how much depth changes along the height; yz: least and largest depth.
layout(location = 5) flat out vec4 plane_depths;
layout(location = 6) flat out vec3 normal;

const float GRID = 256.0;   // of a texel

// Place [texels] and depth (1 at the near plane, 0 at the end of the range) of a point.
vec3 mapped(LightView view, vec3 position) {
    vec3 offset = position - view.anchor.xyz;
    vec2 along = vec2(dot(offset, view.right.xyz) / dot(view.right.xyz, view.right.xyz),
        dot(offset, view.down.xyz) / dot(view.down.xyz, view.down.xyz));
    return vec3(round(along * (0.5 * float(view.light.y) * GRID)) / GRID,
        1.0 - dot(offset, view.forward.xyz) / view.right.w);
}

void main() {
    LightView view = light_views[params.view];
    // What is flat is that of a triangle's first corner, which has the triangle's number
    // (shared/frame.glsl).
    uint triangle = uint(gl_VertexIndex);
    uvec3 vertices = vertices_of(triangle);
    vec3 corners[3], places[3];
    for (uint i = 0u; i < 3u; ++i) {
        corners[i] = position_of(vertices[i]);
        places[i] = mapped(view, corners[i]);
    }
    position_ws = corners[0];
    uv = texture_uv(vertices.x);
    material = triangle_materials[triangle];
    normal = normalize(cross(corners[1] - corners[0], corners[2] - corners[0]));

    vec3 squares;
    for (uint i = 0u; i < 3u; ++i) {
        vec2 edge = places[(i + 1u) % 3u].xy - places[i].xy;
        squares[i] = dot(edge, edge);
    }
    uint start = squares.x >= max(squares.y, squares.z) ? 0u : squares.y >= squares.z ? 1u : 2u;
    vec3 edge = places[(start + 1u) % 3u] - places[start],
         other = places[(start + 2u) % 3u] - places[start];
    vec2 axis = edge.xy / max(squares[start], 1e-12);
    float share = dot(other.xy, axis);
    vec3 height = other - share * edge;
    plane_start = vec4(places[start], edge.z);
    plane_axes = vec4(axis, height.xy / max(dot(height.xy, height.xy), 1e-12));
    plane_depths = vec4(height.z, min(min(places[0].z, places[1].z), places[2].z),
        max(max(places[0].z, places[1].z), places[2].z), 0.0);

    vec2 map = (places[0].xy - vec2(view.light.zw)) * (2.0 / float(view.light.y)) - 1.0;
    gl_Position = vec4(map, places[0].z, 1.0);
}
