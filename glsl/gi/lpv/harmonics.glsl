// The light of a cell: three bands of spherical harmonics of the directions that it comes from. Rgb
// is radiance, alpha the same of an environment of radiance 1.
#ifndef LUMIVOX_LPV_HARMONICS
#define LUMIVOX_LPV_HARMONICS

#include "gi/shared/sh.glsl"

const int COEFFICIENTS = 9;
// of coefficients that share a texel; the last has one
const int COEFFICIENT_PAIRS = 5;

int band_of(int coefficient) {
    return coefficient == 0 ? 0 : coefficient < 4 ? 1 : 2;
}

vec4 irradiance(vec4 coefficients[COEFFICIENTS], vec3 normal) {
    float basis[COEFFICIENTS] = sh_evaluate3(normal);
    vec4 sum = vec4(0.0);
    for (int i = 0; i < COEFFICIENTS; ++i)
        sum += SH_COSINE[band_of(i)] * basis[i] * coefficients[i];
    return max(sum, vec4(0.0));
}

#endif
