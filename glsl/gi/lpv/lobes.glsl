// Cells as lobes of intensity: two bands of spherical harmonics of the directions that light goes
// to, over h² [W/(m² sr)]. Alpha is the same of an environment of radiance 1.
//
// A column of a matrix is a coefficient. So the intensity along a direction is the matrix times the
// basis, and the outer product of a colour with a lobe is a cell.
#ifndef LUMIVOX_LPV_LOBES
#define LUMIVOX_LPV_LOBES

#include "gi/lpv/grid.glsl"
#include "gi/shared/sh.glsl"

const int LOBE_COEFFICIENTS = 4;

// Where two coefficients are in the volume of lobes: 2 blocks across x, and along z one block for
// even steps and one for odd ones. A texel has two times four half floats.
ivec3 pair_texel(CellGrid grid, ivec3 cell, int pair, uint step) {
    return cell + ivec3(pair, 0, step & 1u) * grid.size.xyz;
}

// Where a coefficient is in the sum of all steps: 2×2 blocks across x and y.
ivec3 sum_texel(CellGrid grid, ivec3 cell, int coefficient) {
    return cell + ivec3(coefficient & 1, coefficient >> 1, 0) * grid.size.xyz;
}

uvec4 pack(vec4 first, vec4 second) {
    return uvec4(packHalf2x16(first.xy), packHalf2x16(first.zw), packHalf2x16(second.xy),
        packHalf2x16(second.zw));
}

void unpack(uvec4 words, out vec4 first, out vec4 second) {
    first = vec4(unpackHalf2x16(words.x), unpackHalf2x16(words.y));
    second = vec4(unpackHalf2x16(words.z), unpackHalf2x16(words.w));
}

vec3 axis_direction(uint face) {
    vec3 direction = vec3(0.0);
    direction[face >> 1] = (face & 1u) != 0u ? 1.0 : -1.0;
    return direction;
}

#endif
