// Which way the light of a texel leaves it, from the mean normal of what shines.
#ifndef LUMIVOX_LIT_NORMALS
#define LUMIVOX_LIT_NORMALS

float luminance(vec3 color) {
    return dot(color, vec3(0.2126, 0.7152, 0.0722));
}

// Share of a texel's light that leaves towards a viewer who looks along `direction`: the share of
// the surfaces that face him. Their normals are spread around the mean m / |m| with Toksvig's
// variance σ² = (1 − |m|) / |m|, so that n·ω is normally distributed. A logistic function stands
// in for the distribution function.
float facing_share(vec3 m, vec3 direction) {
    float concentration = clamp(length(m), 1e-4, 0.999);
    return 1.0
        / (1.0
            + exp(1.702 * dot(m, direction) * inversesqrt(concentration * (1.0 - concentration))));
}

#endif
