// The including pass declares `light` and `light_band2`, images that it writes.
#ifndef LUMIVOX_LPV_STORE_LIGHT
#define LUMIVOX_LPV_STORE_LIGHT

#include "gi/lpv/light.glsl"

void store_light(CellGrid grid, ivec3 cell, int coefficient, vec4 value) {
    ivec3 texel = light_texel(grid, cell, coefficient);
    if (coefficient < LOW_COEFFICIENTS) {
        imageStore(light, texel, value);
    } else {
        imageStore(light_band2, texel, value);
    }
}

#endif
