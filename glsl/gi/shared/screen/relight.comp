#version 460
#extension GL_GOOGLE_include_directive : require
// screen.relight: how light has changed: what a few pixels of the frame before gathered, against
// what they gather now along the same directions (after Schied et al. 2018). rgb: the factor that
// brings what they gathered to what they gather now in the mean; a: by how much they still differ
// then, from 0 to 1.
layout(local_size_x = 8, local_size_y = 8) in;

layout(set = 1, binding = 0) uniform texture2D kept_depth;
layout(set = 1, binding = 1) uniform texture2D kept_light;
layout(set = 1, binding = 2) uniform texture2D light_again;
layout(set = 1, binding = 3, rgba32f) uniform restrict writeonly image2D change;

#include "shared/gathered.glsl"

const int REACH = 2, SIDE = 2 * REACH + 1;   // texels
const float SIGMA = 0.5 * (float(REACH) + 1.0);

// A larger factor is none: what was dark says little of what is bright.
const float LARGEST_FACTOR = 4.0;

// What a texel gathered and gathers, and what it weighs for one so far away; 0 where it has nothing
// to tell.
float pair_at(ivec2 texel, ivec2 away, out vec3 before, out vec3 now) {
    ivec2 at = texel + away;
    before = now = vec3(0.0);
    if (any(lessThan(at, ivec2(0))) || !is_gathered(at)
        || texelFetch(sampler2D(kept_depth, nearest_clamp), at, 0).r <= 0.0)
        return 0.0;
    before = texelFetch(sampler2D(kept_light, nearest_clamp), at, 0).rgb;
    now = texelFetch(sampler2D(light_again, nearest_clamp), at, 0).rgb;
    if (any(isnan(before + now)) || any(isinf(before + now))) return 0.0;
    return exp(-0.5 * float(away.x * away.x + away.y * away.y) / (SIGMA * SIGMA));
}

void main() {
    ivec2 texel = ivec2(gl_GlobalInvocationID.xy);
    if (!is_gathered(texel)) return;
    vec3 before, now, before_sum = vec3(0.0), now_sum = vec3(0.0);
    for (int i = 0; i < SIDE * SIDE; ++i) {
        float weight = pair_at(texel, ivec2(i % SIDE, i / SIDE) - REACH, before, now);
        before_sum += weight * before;
        now_sum += weight * now;
    }
    // Equal sums have a factor of exactly 1.
    vec3 factor = mix(vec3(1.0), min(now_sum / max(before_sum, 1e-30), LARGEST_FACTOR),
        greaterThan(before_sum, vec3(0.0)));
    float apart = 0.0, all = 0.0;
    for (int i = 0; i < SIDE * SIDE; ++i) {
        float weight = pair_at(texel, ivec2(i % SIDE, i / SIDE) - REACH, before, now);
        apart += weight * dot(abs(now - factor * before), vec3(1.0));
        all += weight * dot(max(now, factor * before), vec3(1.0));
    }
    imageStore(change, texel, vec4(factor, all > 0.0 ? apart / all : 0.0));
}
