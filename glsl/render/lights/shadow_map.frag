#version 460
#extension GL_GOOGLE_include_directive : require
// render.shadow_maps: depth only; masked texels let light through. With CASCADE, depth is that of
// the triangle's plane (light_cascade.vert).
#include "shared/light_view.glsl"
#include "shared/material.glsl"

layout(location = 1) in vec2 uv;

layout(constant_id = 0) const bool MASKED = true;   // every material has a mask

#ifdef CASCADE
#include "render/lights/cascade_depth.glsl"
#endif

void main() {
    if (MASKED) {
        if (texture(sampler2D(mask_texture, linear_repeat), uv).r < 0.5) discard;
    }
#ifdef CASCADE
    gl_FragDepth = cascade_depth();
#endif
}
