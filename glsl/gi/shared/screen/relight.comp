#version 460
#extension GL_GOOGLE_include_directive : require
// screen.relight: by how much light has changed, from 0 to 1: what a few pixels of the frame before
// gathered, against what they gather now along the same directions (after Schied et al. 2018).
layout(local_size_x = 8, local_size_y = 8) in;

layout(set = 1, binding = 0) uniform texture2D kept_depth;
layout(set = 1, binding = 1) uniform texture2D kept_light;
layout(set = 1, binding = 2) uniform texture2D light_again;
layout(set = 1, binding = 3, r32f) uniform restrict writeonly image2D change;

#include "shared/gathered.glsl"

const int REACH = 2;   // texels
const float SIGMA = 0.5 * (float(REACH) + 1.0);

float sum_of(vec3 light) {
    return light.r + light.g + light.b;
}

void main() {
    ivec2 texel = ivec2(gl_GlobalInvocationID.xy);
    if (!is_gathered(texel)) return;
    float apart = 0.0, all = 0.0;
    for (int y = -REACH; y <= REACH; ++y) {
        for (int x = -REACH; x <= REACH; ++x) {
            ivec2 at = texel + ivec2(x, y);
            if (any(lessThan(at, ivec2(0))) || !is_gathered(at)
                || texelFetch(sampler2D(kept_depth, nearest_clamp), at, 0).r <= 0.0)
                continue;
            vec3 before = texelFetch(sampler2D(kept_light, nearest_clamp), at, 0).rgb,
                 now = texelFetch(sampler2D(light_again, nearest_clamp), at, 0).rgb;
            if (any(isnan(before + now)) || any(isinf(before + now))) continue;
            float weight = exp(-0.5 * float(x * x + y * y) / (SIGMA * SIGMA));
            apart += weight * sum_of(abs(now - before));
            all += weight * sum_of(max(now, before));
        }
    }
    imageStore(change, texel, vec4(all > 0.0 ? apart / all : 0.0));
}
