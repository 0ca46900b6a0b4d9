#version 460
#extension GL_GOOGLE_include_directive : require
// prt.lobes_view: balls over the picture, each with the transfer of the point below its middle: a
// place of the ball's surface has what light from its direction brings. One harmonic is added at a
// time; prt.points has drawn what points have of it.
layout(local_size_x = 8, local_size_y = 8) in;

#include "shared/frame.glsl"

layout(set = 1, binding = 0) uniform texture2D drawn;
layout(set = 1, binding = 1, rgba32f) uniform restrict image2D seen;

layout(push_constant) uniform LobesViewParams {
    uint l;
    int m;
    uint tile_px;   // from ball to ball
} params;

#include "gi/shared/sh.glsl"

// How much of a tile a ball fills.
const float BALL = 0.9;

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy), size = imageSize(seen);
    if (any(greaterThanEqual(pixel, size))) return;
    int tile_px = int(params.tile_px);
    ivec2 middle = pixel / tile_px * tile_px + tile_px / 2;
    vec2 off = (vec2(pixel - middle) + 0.5) / (0.5 * BALL * float(tile_px));
    bool is_first = params.l == 0u;
    bool is_ball = dot(off, off) < 1.0 && all(lessThan(middle, size));
    // Beside balls: how open surfaces are, dimmed.
    vec4 own = texelFetch(sampler2D(drawn, nearest_clamp), is_ball ? middle : pixel, 0);
    if (!is_ball) {
        if (is_first) imageStore(seen, pixel, vec4(vec3(0.2 * own.a), 1.0));
        return;
    }
    vec3 right = normalize(frame.ray_right.xyz), up = normalize(frame.ray_up.xyz);
    float towards = sqrt(1.0 - dot(off, off));
    vec3 direction = off.x * right - off.y * up - towards * frame.ray_forward.xyz;
    vec3 before = is_first ? vec3(0.0) : imageLoad(seen, pixel).rgb;
    vec3 light = before + sh_harmonic(params.l, params.m, direction) * own.rgb;
    imageStore(seen, pixel, vec4(light, 1.0));
}
