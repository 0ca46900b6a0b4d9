// Depth of a texel of a cascade, from what light_cascade.vert says of its triangle.
#ifndef LUMIVOX_CASCADE_DEPTH
#define LUMIVOX_CASCADE_DEPTH

#include "shared/light_view.glsl"

layout(std430, set = 1, binding = 0) readonly buffer LightViews { LightView light_views[]; };

layout(push_constant) uniform ViewParams { uint view; } params;

layout(location = 3) flat in vec4 plane_start;
layout(location = 4) flat in vec4 plane_axes;
layout(location = 5) flat in vec4 plane_depths;

float cascade_depth() {
    vec2 texel = gl_FragCoord.xy + vec2(light_views[params.view].light.zw);
    vec2 offset = texel - plane_start.xy;
    float depth = plane_start.z + plane_start.w * dot(offset, plane_axes.xy)
        + plane_depths.x * dot(offset, plane_axes.zw);
    return clamp(depth, plane_depths.y, plane_depths.z);
}

#endif
