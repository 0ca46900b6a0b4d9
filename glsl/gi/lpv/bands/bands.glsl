// Cells as intensity in three or four bands of spherical harmonics of the directions that light
// goes to, over h² [W/(m² sr)]. Alpha is the same of an environment of radiance 1.
#ifndef LUMIVOX_LPV_BANDS
#define LUMIVOX_LPV_BANDS

#include "gi/lpv/grid.glsl"
#include "gi/lpv/pairs.glsl"
#include "gi/shared/sh.glsl"

layout(constant_id = 0) const int BANDS = 4;

const int MOST_COEFFICIENTS = 16;
const int BAND_COEFFICIENTS = BANDS * BANDS;
// of coefficients that share a texel; the last may have one
const int BAND_PAIRS = (BAND_COEFFICIENTS + 1) / 2;

// Where two coefficients are in the volume of a step: blocks across x, and along z one block for
// even steps and one for odd ones.
ivec3 pair_texel(CellGrid grid, ivec3 cell, int pair, uint step) {
    return cell + ivec3(pair, 0, step & 1u) * grid.size.xyz;
}

// Where a coefficient is in the sum of all steps: blocks across x and y.
ivec3 sum_texel(CellGrid grid, ivec3 cell, int coefficient) {
    return cell + ivec3(coefficient % BANDS, coefficient / BANDS, 0) * grid.size.xyz;
}

// What band l of a clamped cosine is multiplied by; that of l = 3 is 0.
float cosine_factor(int coefficient) {
    return coefficient == 0 ? SH_COSINE.x
        : coefficient < 4   ? SH_COSINE.y
        : coefficient < 9   ? SH_COSINE.z
                            : 0.0;
}

#endif
