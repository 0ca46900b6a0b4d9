// Texels that shine by their normals: they hold the light of both sides together, and the mean
// normal of what shines times its luminance (gi/shared/voxel/light/lit_normals.glsl).
#ifndef LUMIVOX_NORMALS
#define LUMIVOX_NORMALS

#include "shared/luminance.glsl"

// 0: texels shine alike to all sides; 1: by Toksvig's lobe; 2: by two bands of harmonics; 3: by
// Toksvig's lobe, convolved with that of the view cone.
layout(constant_id = 6) const uint NORMALS = 0;

// σ_v² of the view cone's lobe.
float view_variance = 0.0;

// σ_v = cos φ, with φ the aperture of the cone (Hong 2015, section 2.5.3.3.5).
void set_view_lobe(float tan_half) {
    float square = tan_half * tan_half;
    float deviation = max(1.0 - square, 0.0) / (1.0 + square);
    if (NORMALS == 3u) view_variance = deviation * deviation;
}

// Share of a texel's light that leaves towards a viewer who looks along `direction`: the share of
// the surfaces that face him. Their normals are spread around the mean m / |m| with Toksvig's
// variance σ² = (1 − |m|) / |m|, so that n·ω is normally distributed; the view cone's adds to it. A
// logistic function stands in for the distribution function.
float toksvig_share(vec3 m, vec3 direction) {
    float concentration = clamp(length(m), 1e-4, 0.999);
    float width = concentration * (1.0 - concentration);   // (|m| σ)²
    if (NORMALS == 3u) width += concentration * concentration * view_variance;
    return 1.0 / (1.0 + exp(1.702 * dot(m, direction) * inversesqrt(width)));
}

// The same share by the first two bands of what a one-sided surface sends: 1/2 + 3/4 n·v.
float harmonic_share(vec3 m, vec3 direction) {
    return max(0.5 - 0.75 * dot(m, direction), 0.0);
}

// The light of a texel, which may be premultiplied, as seen along `direction`.
vec3 seen_by_normals(vec3 light, vec3 normal, vec3 direction) {
    vec3 m = normal / max(luminance_of(light), 1e-20);
    float share;
    if (NORMALS == 2u) share = harmonic_share(m, direction);
    else share = toksvig_share(m, direction);
    return share * light;
}

#endif
