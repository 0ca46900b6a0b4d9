// What a lobe reflects of light that is the same from all sides, the second factor of the split sum
// (Karis 2013). The including pass binds `split_sum` (Rust: gi::shared::split_sum).
#ifndef LUMIVOX_SPLIT_SUM
#define LUMIVOX_SPLIT_SUM

// x: times F₀; y: besides.
vec2 reflected_by_lobe(float cosine, float roughness) {
    ivec2 last = textureSize(sampler2D(split_sum, nearest_clamp), 0) - 1;
    vec2 at = clamp(vec2(cosine, roughness) * vec2(last + 1) - 0.5, vec2(0.0), vec2(last));
    ivec2 low = min(ivec2(at), last - 1);
    vec2 between = at - vec2(low), sum = vec2(0.0);
    for (int corner = 0; corner < 4; ++corner) {
        ivec2 step = ivec2(corner & 1, corner >> 1);
        vec2 share = mix(1.0 - between, between, vec2(step));
        sum += share.x * share.y
            * texelFetch(sampler2D(split_sum, nearest_clamp), low + step, 0).rg;
    }
    return sum;
}

#endif
