// Radiance off a surface, direction by direction: of the pairs of directions whose radiance
// lpv.sweep has kept for all cells. The including pass includes shared/gbuffer.glsl before, and
// declares `radiance`, an image of them, and `directions` with `octants`.
#ifndef LUMIVOX_LPV_BY_DIRECTION
#define LUMIVOX_LPV_BY_DIRECTION

#include "gi/lpv/grid.glsl"
#include "gi/lpv/pairs.glsl"

layout(constant_id = 0) const bool MASKED = false;   // no light of cells behind the surface
layout(constant_id = 1) const bool ADD = false;      // to what batches before have left
layout(constant_id = 2) const bool LAST = false;     // no batch follows

layout(push_constant) uniform DirectionParams {
    CellGrid grid;
    float shift;          // off the surface [cells]
    float scale;          // radiance of a stored 1 [W/(m² sr)]
    uint first_octant;    // of the batch
    uint octant_count;
    uint first_pair;      // of each octant
    uint pair_count;
    float least_width;    // of a lobe, squared [rad²]
} params;

#include "gi/lpv/corners.glsl"

Corners corners_off(Surface surface) {
    vec3 place = to_cells(params.grid, surface.position_ws);
    return corners_around(shifted(place, surface.geometric_normal, params.shift), place,
        surface.geometric_normal, MASKED);
}

// A block of cells along z is a pair of directions.
Pair radiance_at(Corners corners, int block) {
    Pair sum = Pair(vec4[2](vec4(0.0), vec4(0.0)));
    ivec3 first = ivec3(0, 0, block * params.grid.size.z);
    for (int i = 0; i < 8; ++i) {
        if (corners.weights[i] == 0.0) continue;
        Pair found = unpack(imageLoad(radiance, first + corners.cells[i]));
        sum.radiance[0] += corners.weights[i] * found.radiance[0];
        sum.radiance[1] += corners.weights[i] * found.radiance[1];
    }
    return sum;
}

// W/(m² sr); environment included
vec3 whole(vec4 stored) { return params.scale * stored.rgb + stored.a * uniform_environment(); }

#endif
