// Where the light of cells is: two images, `light` of bands 0 and 1 and `light_band2`, so that two
// bands alone need no more than the first.
#ifndef LUMIVOX_LPV_LIGHT
#define LUMIVOX_LPV_LIGHT

#include "gi/lpv/grid.glsl"
#include "gi/lpv/harmonics.glsl"

// Of bands 0 and 1.
const int LOW_COEFFICIENTS = 4;

// Where a coefficient is in its image, in blocks of a grid's cells: 2×2 of them across x and y, or
// five across x.
ivec3 light_block(int coefficient) {
    return coefficient < LOW_COEFFICIENTS
        ? ivec3(coefficient & 1, coefficient >> 1, 0)
        : ivec3(coefficient - LOW_COEFFICIENTS, 0, 0);
}

ivec3 light_texel(CellGrid grid, ivec3 cell, int coefficient) {
    return cell + light_block(coefficient) * grid.size.xyz + ivec3(0, 0, grid.first.w);
}

#endif
