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

layout(push_constant) uniform DeinterleaveParams {
    uvec2 window;            // w, h [px]
    float plane_tolerance;   // [footprints]
    float normal_cosine;
} params;

#include "gi/shared/screen/one_surface.glsl"

void main() {
    ivec2 texel = ivec2(gl_GlobalInvocationID.xy), size = ivec2(frame.gathered.xy);
    if (!is_gathered(texel)) return;
    Surface surface;
    vec4 sum = vec4(0.0);
    if (read_receiver(texel, surface)) {
        Own own = own_surface(surface, params.plane_tolerance, params.normal_cosine);
        ivec2 window = ivec2(params.window), reach = window / 2;
        // Of the outermost columns and rows.
        vec2 last = vec2(window.x % 2 == 0 ? 0.5 : 1.0, window.y % 2 == 0 ? 0.5 : 1.0);
        float weight_sum = 0.0;
        for (int y = -reach.y; y <= reach.y; ++y) {
            for (int x = -reach.x; x <= reach.x; ++x) {
                ivec2 at = texel + ivec2(x, y);
                if (any(lessThan(at, ivec2(0))) || any(greaterThanEqual(at, size))
                    || (at != texel && !shares_surface(own, at)))
                    continue;
                float weight =
                    (abs(x) == reach.x ? last.x : 1.0) * (abs(y) == reach.y ? last.y : 1.0);
                sum += weight * texelFetch(sampler2D(interleaved, nearest_clamp), at, 0);
                weight_sum += weight;
            }
        }
        sum /= max(weight_sum, 1.0);
    }
    imageStore(indirect_diffuse, texel, sum);
}
