// Which probes are around a place. The including pass declares `params` with a LookupRow `lookup`,
// or another one as LOOKUP; with SPARSE not all probes are there, and it has a `probe_at` of its
// own.
#ifndef LUMIVOX_PROBES_CAGE
#define LUMIVOX_PROBES_CAGE

#include "gi/probes/lookup_row.glsl"

#ifndef LOOKUP
#define LOOKUP params.lookup
#endif

#ifndef SPARSE
const uint NO_PROBE = 0xffffffffu;

uint probe_at(uvec3 place) {
    uvec3 counts = LOOKUP.counts.xyz;
    return place.x + counts.x * (place.y + counts.y * place.z);
}
#endif

// The eight probes around a place that surfaces look them up from.
struct Cage {
    vec3 moved;      // the place [m]
    uvec3 first;     // of the probes
    vec3 between;    // 0 to 1 from the first to the next along each axis
};

Cage cage_around(vec3 position, vec3 normal) {
    LookupRow row = LOOKUP;
    vec3 moved = position + row.normal_bias_m * normal;
    vec3 last = vec3(row.counts.xyz) - 1.0;
    vec3 place = clamp((moved - row.first.xyz) / row.spacing.xyz, vec3(0.0), last);
    vec3 first = min(floor(place), last - 1.0);
    return Cage(moved, uvec3(first), place - first);
}

uvec3 step_to(uint corner) {
    return uvec3(corner, corner >> 1, corner >> 2) & 1u;
}

// The trilinear weight of a corner, at least a thousandth along each axis.
float share_of(Cage cage, uint corner) {
    vec3 t = max(mix(1.0 - cage.between, cage.between, vec3(step_to(corner))), 1e-3);
    return t.x * t.y * t.z;
}

#endif
