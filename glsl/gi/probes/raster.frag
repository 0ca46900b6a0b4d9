#version 460
#extension GL_GOOGLE_include_directive : require
// probes.raster: which triangle a probe sees; it looks through masked texels.
#include "shared/frame.glsl"
#include "shared/material.glsl"

layout(location = 0) in vec2 uv;
layout(location = 1) flat in uint triangle;

layout(location = 0) out uint seen;

void main() {
    if (materials[triangle_materials[triangle]].albedo.w > 0.0
        && texture(sampler2D(mask_texture, linear_repeat), uv).r < 0.5)
        discard;
    seen = triangle;
}
