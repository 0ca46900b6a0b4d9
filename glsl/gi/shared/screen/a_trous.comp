#version 460
#extension GL_GOOGLE_include_directive : require
// screen.a_trous: one level of a wavelet filter with holes that stops where luminance differs by
// more than its noise explains (Dammertz et al. 2010; Schied et al. 2017, section 4.3).
layout(local_size_x = 8, local_size_y = 8) in;

layout(set = 1, binding = 0) uniform texture2D view_depth;
layout(set = 1, binding = 1) uniform utexture2D normals;
layout(set = 1, binding = 2) uniform texture2D light;
layout(set = 1, binding = 3) uniform texture2D variance;
layout(set = 1, binding = 4, rgba32f) uniform restrict writeonly image2D filtered;
layout(set = 1, binding = 5, r32f) uniform restrict writeonly image2D filtered_variance;

layout(push_constant) uniform ATrousParams {
    int step;                // between taps [px]
    float contrast;          // standard deviations of luminance at which a tap weighs 1/e
    float plane_tolerance;   // [footprints]
    float normal_cosine;
} params;

#include "gi/shared/screen/one_surface.glsl"
#include "shared/luminance.glsl"

// B3 spline: weights of taps 0, 1 and 2 steps away.
const float SPLINE[3] = float[3](0.375, 0.25, 0.0625);

// Below this standard deviation [W/m²] light has no noise.
const float LEAST_DEVIATION = 1e-6;

// Of this pixel and the eight around it, by a binomial.
float smooth_variance(ivec2 pixel, ivec2 size) {
    float sum = 0.0;
    for (int y = -1; y <= 1; ++y) {
        for (int x = -1; x <= 1; ++x) {
            ivec2 at = clamp(pixel + ivec2(x, y), ivec2(0), size - 1);
            float weight = 0.0625 * float((2 - abs(x)) * (2 - abs(y)));
            sum += weight * texelFetch(sampler2D(variance, nearest_clamp), at, 0).r;
        }
    }
    return sum;
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy), size = ivec2(frame.size_px.xy);
    if (any(greaterThanEqual(pixel, size))) return;
    Surface surface;
    if (!read_surface(pixel, surface)) {
        imageStore(filtered, pixel, vec4(0.0));
        imageStore(filtered_variance, pixel, vec4(0.0));
        return;
    }
    Own own = own_surface(surface, params.plane_tolerance, params.normal_cosine);
    float luminance =
        luminance_of(texelFetch(sampler2D(light, nearest_clamp), pixel, 0).rgb);
    float deviation = params.contrast * sqrt(smooth_variance(pixel, size)) + LEAST_DEVIATION;
    vec4 sum = vec4(0.0);
    float weights = 0.0, variances = 0.0;
    for (int y = -2; y <= 2; ++y) {
        for (int x = -2; x <= 2; ++x) {
            ivec2 tap = pixel + params.step * ivec2(x, y);
            if (any(lessThan(tap, ivec2(0))) || any(greaterThanEqual(tap, size))
                || (tap != pixel && !shares_surface(own, tap)))
                continue;
            vec4 other = texelFetch(sampler2D(light, nearest_clamp), tap, 0);
            float apart = abs(luminance_of(other.rgb) - luminance);
            float weight = SPLINE[abs(x)] * SPLINE[abs(y)] * exp(-apart / deviation);
            sum += weight * other;
            weights += weight;
            variances +=
                weight * weight * texelFetch(sampler2D(variance, nearest_clamp), tap, 0).r;
        }
    }
    imageStore(filtered, pixel, sum / weights);
    imageStore(filtered_variance, pixel, vec4(variances / (weights * weights)));
}
