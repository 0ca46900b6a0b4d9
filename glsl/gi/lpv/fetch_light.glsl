// The including pass declares `light` and `light_band2`, textures, and a constant `HAS_BAND2`: with
// two bands `light_band2` is not read.
#ifndef LUMIVOX_LPV_FETCH_LIGHT
#define LUMIVOX_LPV_FETCH_LIGHT

#include "gi/lpv/light.glsl"

// The light of a cell.
vec4[COEFFICIENTS] fetch_light_of(CellGrid grid, ivec3 cell) {
    vec4 found[COEFFICIENTS];
    for (int i = 0; i < COEFFICIENTS; ++i) {
        ivec3 texel = light_texel(grid, cell, i);
        found[i] = i < LOW_COEFFICIENTS ? texelFetch(sampler3D(light, nearest_clamp), texel, 0)
            : HAS_BAND2 ? texelFetch(sampler3D(light_band2, nearest_clamp), texel, 0)
                        : vec4(0.0);
    }
    return found;
}

#endif
