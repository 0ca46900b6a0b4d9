#version 460
#extension GL_GOOGLE_include_directive : require
// screen.blur: a mean along one axis of the picture over pixels of one surface, by a Gaussian (a
// separable bilateral filter, Pham & van Vliet 2005; Hong 2015, section 4.2). The more history a
// pixel has, the narrower it is.
layout(local_size_x = 8, local_size_y = 8) in;

layout(constant_id = 0) const bool HAS_GUIDE = false;
layout(constant_id = 1) const bool IS_ADAPTIVE = false;

layout(set = 1, binding = 0) uniform texture2D view_depth;
layout(set = 1, binding = 1) uniform utexture2D normals;
layout(set = 1, binding = 2) uniform texture2D light;
// x: view depth [m]; z: shading normal; w: weight of history [frames]
layout(set = 1, binding = 3) uniform utexture2D guide;
layout(set = 1, binding = 4, rgba32f) uniform restrict writeonly image2D blurred;

layout(push_constant) uniform BlurParams {
    uint axis;               // 0: rows, 1: columns
    float radius;            // of a pixel with at most four directions [px]
    float least_radius;      // [px]
    float directions;        // of a pixel, in a frame
    float plane_tolerance;   // [footprints]
    float normal_cosine;
} params;

#include "gi/shared/screen/one_surface.glsl"

float radius_of(ivec2 pixel) {
    float frames = 1.0;
    if (HAS_GUIDE) {
        float weight = uintBitsToFloat(texelFetch(usampler2D(guide, nearest_clamp), pixel, 0).w);
        if (IS_ADAPTIVE) frames = max(weight, 1.0);
    }
    float directions = frames * params.directions;
    return max(params.radius * min(1.0, 4.0 / directions), params.least_radius);
}

// One fetch where there is a guide, and two where there is none.
bool is_same(Own own, ivec2 tap) {
    if (HAS_GUIDE) {
        uvec4 seen = texelFetch(usampler2D(guide, nearest_clamp), tap, 0);
        return is_on_plane(own, tap, uintBitsToFloat(seen.x)) && has_normal(own, seen.z);
    }
    return shares_surface(own, tap);
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy), size = ivec2(frame.size_px.xy);
    if (any(greaterThanEqual(pixel, size))) return;
    Surface surface;
    if (!read_surface(pixel, surface)) {
        imageStore(blurred, pixel, vec4(0.0));
        return;
    }
    float radius = radius_of(pixel), sigma = 0.5 * (radius + 1.0);
    int reach = int(radius + 0.5);
    Own own = own_surface(surface, params.plane_tolerance, params.normal_cosine);
    vec4 sum = vec4(0.0);
    float weight_sum = 0.0;
    for (int i = -reach; i <= reach; ++i) {
        ivec2 tap = pixel;
        tap[params.axis] += i;
        if (tap[params.axis] < 0 || tap[params.axis] >= size[params.axis]
            || (i != 0 && !is_same(own, tap)))
            continue;
        float weight = exp(-0.5 * float(i * i) / (sigma * sigma));
        sum += weight * texelFetch(sampler2D(light, nearest_clamp), tap, 0);
        weight_sum += weight;
    }
    imageStore(blurred, pixel, sum / weight_sum);
}
