#version 460
#extension GL_GOOGLE_include_directive : require
// screen.variance: of the luminance of each pixel's light, as its frames so far differ; where there
// are few, as its neighbours do (Schied et al. 2017, section 4.2).
layout(local_size_x = 8, local_size_y = 8) in;

layout(constant_id = 0) const bool HAS_MOMENTS = false;

layout(set = 1, binding = 0) uniform texture2D view_depth;
layout(set = 1, binding = 1) uniform utexture2D normals;
layout(set = 1, binding = 2) uniform texture2D light;
layout(set = 1, binding = 3) uniform utexture2D guide;   // w: weight of light [frames]
layout(set = 1, binding = 4) uniform texture2D moments;  // x: mean of luminance; y: of its square
layout(set = 1, binding = 5, r32f) uniform restrict writeonly image2D variance;

layout(push_constant) uniform VarianceParams {
    float plane_tolerance;   // [footprints]
    float normal_cosine;
} params;

#include "gi/shared/screen/one_surface.glsl"
#include "shared/luminance.glsl"

const int REACH = 3;              // px
const float ENOUGH_FRAMES = 4.0;

float of_neighbours(ivec2 pixel, Surface surface) {
    Own own = own_surface(surface, params.plane_tolerance, params.normal_cosine);
    ivec2 size = ivec2(frame.size_px.xy);
    vec3 sums = vec3(0.0);   // of luminance, its square, and 1
    for (int y = -REACH; y <= REACH; ++y) {
        for (int x = -REACH; x <= REACH; ++x) {
            ivec2 tap = pixel + ivec2(x, y);
            if (any(lessThan(tap, ivec2(0))) || any(greaterThanEqual(tap, size))
                || (tap != pixel && !shares_surface(own, tap)))
                continue;
            float l = luminance_of(texelFetch(sampler2D(light, nearest_clamp), tap, 0).rgb);
            sums += vec3(l, l * l, 1.0);
        }
    }
    vec2 means = sums.xy / max(sums.z, 1.0);
    return max(means.y - means.x * means.x, 0.0);
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, ivec2(frame.size_px.xy)))) return;
    Surface surface;
    float found = 0.0;
    if (read_surface(pixel, surface)) {
        float frames = 0.0;
        if (HAS_MOMENTS)
            frames = uintBitsToFloat(texelFetch(usampler2D(guide, nearest_clamp), pixel, 0).w);
        if (frames >= ENOUGH_FRAMES) {
            vec2 means = texelFetch(sampler2D(moments, nearest_clamp), pixel, 0).xy;
            found = max(means.y - means.x * means.x, 0.0) / frames;
        } else {
            found = of_neighbours(pixel, surface);
        }
    }
    imageStore(variance, pixel, vec4(found));
}
