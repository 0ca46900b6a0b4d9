#version 460
#extension GL_GOOGLE_include_directive : require
// probes.moments_power: mean and mean square of the distance (cells) that a probe sees by
// direction, over all of its rays, by a power of the cosine (Majercik et al. 2019). A thread a
// texel.
layout(local_size_x = 64) in;

layout(set = 1, binding = 0) uniform texture2D ray_set;
layout(set = 1, binding = 1) uniform utexture2D ray_hits;
layout(set = 1, binding = 2, rg16f) uniform restrict writeonly image2D probe_moments;
#define LIST_BINDING 3

#include "shared/frame.glsl"
#include "gi/probes/moments.glsl"
#include "gi/probes/rays.glsl"

// Below this weight a ray is left out.
const float LEAST_WEIGHT = 1e-6;

// The 50th power.
float sharpened(float cosine) {
    float c2 = cosine * cosine, c4 = c2 * c2, c8 = c4 * c4, c16 = c8 * c8;
    return c16 * c16 * c16 * c2;
}

void main() {
    uint index = moment_texel();
    if (index >= params.all) return;
    uvec2 probe = probe_of(index);
    uint count = params.ray_count;
    // The rays as they are before they are turned.
    vec3 axis = direction_of_texel(vec2(place_of(index)), params.edge) * turn_of(probe.y);
    vec2 sum = vec2(0.0);
    float weights = 0.0;
    for (uint ray = 0u; ray < count; ++ray) {
        float weight = sharpened(max(dot(axis, ray_of_set(ray)), 0.0));
        if (weight < LEAST_WEIGHT) continue;
        ivec2 place = texel_of_ray(probe.x * count + ray);
        uint distance = texelFetch(usampler2D(ray_hits, nearest_clamp), place, 0).w;
        sum += weight * moments_of(uintBitsToFloat(distance));
        weights += weight;
    }
    store_moments(index, sum / max(weights, 1e-30));
}
