// The cells around a position. The including pass declares push constants `params` with `grid`.
#ifndef LUMIVOX_LPV_CORNERS
#define LUMIVOX_LPV_CORNERS

#include "gi/lpv/grid.glsl"

struct Corners {
    ivec3 cells[8];
    float weights[8];   // their sum is 1
};

// How far a cell's centre must be in front of a surface [cells]: on which side of a centre in it
// the opaque face is, rounding decides.
const float IN_FRONT = 0.02;   // Rust: IN_FRONT of lpv::oracle::lookup

// The eight cells around a position with their trilinear weights. With `masked`, cells whose centre
// is not in front of the plane of the surface weigh nothing, unless all are so. Positions are in
// cells.
Corners corners_around(vec3 position, vec3 surface, vec3 normal, bool masked) {
    ivec3 last = params.grid.size.xyz - 1;
    vec3 low = floor(position - 0.5), part = position - 0.5 - low;
    Corners corners;
    float all = 0.0, plain[8];
    for (int i = 0; i < 8; ++i) {
        ivec3 side = ivec3(i & 1, i >> 1 & 1, i >> 2);
        ivec3 cell = ivec3(low) + side;
        vec3 share = mix(1.0 - part, part, vec3(side));
        plain[i] = share.x * share.y * share.z;
        bool is_behind = dot(vec3(cell) + 0.5 - surface, normal) < IN_FRONT;
        corners.weights[i] = masked && is_behind ? 0.0 : plain[i];
        corners.cells[i] = clamp(cell, ivec3(0), last);
        all += corners.weights[i];
    }
    for (int i = 0; i < 8; ++i)
        corners.weights[i] = all > 0.0 ? corners.weights[i] / all : plain[i];
    return corners;
}

#endif
