#version 460
#extension GL_GOOGLE_include_directive : require
// gi.deinterleave: the mean over the pixels around that lie on the pixel's own surface, in a window
// w×h pixels large and centred on the pixel. Patterns repeat every w and h pixels: where that is
// even, the outermost columns or rows hold the same patterns and count half each. On a plane every
// pixel has each of the w·h patterns with the same weight (interleaved sampling, Keller & Heidrich
// 2001; Hong 2015, section 3), and a gradient stays where it is.
layout(local_size_x = 8, local_size_y = 8) in;

layout(set = 1, binding = 0) uniform texture2D view_depth;
layout(set = 1, binding = 1) uniform utexture2D normals;
layout(set = 1, binding = 2) uniform texture2D interleaved;
layout(set = 1, binding = 3, rgba32f) uniform restrict writeonly image2D indirect_diffuse;

layout(push_constant) uniform DeinterleaveParams { uvec2 window; } params;   // w, h [px]

#include "shared/gbuffer.glsl"

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy), size = ivec2(frame.size_px.xy);
    if (any(greaterThanEqual(pixel, size))) return;
    Surface surface;
    vec4 sum = vec4(0.0);
    if (read_surface(pixel, surface)) {
        float footprint = length(surface.position_ws - frame.eye_ws.xyz) * 2.0
            * length(frame.ray_up.xyz) / float(size.y);
        ivec2 window = ivec2(params.window), reach = window / 2, taps = 2 * reach + 1;
        // Of the outermost columns and rows.
        vec2 last = vec2(window.x % 2 == 0 ? 0.5 : 1.0, window.y % 2 == 0 ? 0.5 : 1.0);
        float weight_sum = 0.0;
        for (int i = 0; i < taps.x * taps.y; ++i) {
            ivec2 offset = ivec2(i % taps.x, i / taps.x) - reach;
            ivec2 at = pixel + offset;
            Surface other;
            if (any(lessThan(at, ivec2(0))) || any(greaterThanEqual(at, size))
                || !read_surface(at, other))
                continue;
            float off_plane =
                abs(dot(other.position_ws - surface.position_ws, surface.geometric_normal));
            if (off_plane > 0.5 * footprint
                || dot(other.shading_normal, surface.shading_normal) < 0.9)
                continue;
            float weight = (abs(offset.x) == reach.x ? last.x : 1.0)
                * (abs(offset.y) == reach.y ? last.y : 1.0);
            sum += weight * texelFetch(sampler2D(interleaved, nearest_clamp), at, 0);
            weight_sum += weight;
        }
        sum /= max(weight_sum, 1.0);
    }
    imageStore(indirect_diffuse, pixel, sum);
}
