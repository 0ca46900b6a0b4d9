#version 460
#extension GL_GOOGLE_include_directive : require
// screen.upsample: from a coarse picture to all pixels, by a bilinear sample of the texels that
// show a pixel's own surface (joint bilateral upsampling, Kopf et al. 2007).
layout(local_size_x = 8, local_size_y = 8) in;

layout(set = 1, binding = 0) uniform texture2D view_depth;
layout(set = 1, binding = 1) uniform utexture2D normals;
layout(set = 1, binding = 2) uniform texture2D coarse;
layout(set = 1, binding = 3) uniform texture2D left;   // of pixels that no texel shows
layout(set = 1, binding = 4, rgba32f) uniform restrict writeonly image2D upsampled;

layout(push_constant) uniform CoarseParams {
    uvec2 size;              // of the coarse picture [texels]
    uint scale;              // width of a square of pixels that has one of its texels [px]
    float plane_tolerance;   // [footprints]
    float normal_cosine;
} params;

#include "gi/shared/screen/coarse.glsl"

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy), corner;
    if (any(greaterThanEqual(pixel, ivec2(frame.size_px.xy)))) return;
    Surface surface;
    vec4 light = vec4(0.0);
    if (read_surface(pixel, surface)) {
        vec4 weights = coarse_weights(pixel, surface, corner);
        float sum = dot(weights, vec4(1.0));
        if (sum < LEAST_SHOWN) {
            light = texelFetch(sampler2D(left, nearest_clamp), pixel, 0);
        } else {
            for (int i = 0; i < 4; ++i) {
                ivec2 at = corner + ivec2(i & 1, i >> 1);
                if (weights[i] > 0.0)
                    light += weights[i] / sum
                        * texelFetch(sampler2D(coarse, nearest_clamp), at, 0);
            }
        }
    }
    imageStore(upsampled, pixel, light);
}
