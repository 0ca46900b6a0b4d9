// The light of a surface from nested lattices of probes: of the finest that is around it and has
// probes that it sees (docs/gi/probe_cascades.md). The including pass declares `params` with a
// `level_count`, LOOKUP_BINDING and LOOKUP_CONSTANT.
#ifndef LUMIVOX_PROBES_CASCADES_LOOKUP
#define LUMIVOX_PROBES_CASCADES_LOOKUP

// of each level and place: the probe that has its light there, or NO_PROBE
layout(std430, set = 1, binding = LOOKUP_BINDING + 5) restrict readonly buffer ProbeTable {
    uint probe_table[];
};
// of each level, finest first
layout(std430, set = 1, binding = LOOKUP_BINDING + 6) restrict readonly buffer LookupRows {
    LookupRow lookup_rows[];
};

const uint NO_PROBE = 0xffffffffu;

LookupRow level_row;
uint level_first;    // of the table

uint probe_at(uvec3 place) {
    uvec3 counts = level_row.counts.xyz;
    return probe_table[level_first + place.x + counts.x * (place.y + counts.y * place.z)];
}

// Looks probes of one level up from here on.
void choose_level(uint level) {
    level_first = 0u;
    for (uint i = 0u; i < level; ++i) {
        uvec3 counts = lookup_rows[i].counts.xyz;
        level_first += counts.x * counts.y * counts.z;
    }
    level_row = lookup_rows[level];
}

#define SPARSE
#define LOOKUP level_row
#include "gi/probes/lookup.glsl"

// How much of a place's light comes from this level, if its probes are there: less and less in the
// last cell before a side beyond which there are more, and nothing beyond.
float share_of_level(vec3 moved) {
    vec3 at = (moved - level_row.first.xyz) / level_row.spacing.xyz;
    vec3 low = at, high = vec3(level_row.counts.xyz) - 1.0 - at;
    uint open = level_row.counts.w;
    float share = 1.0;
    for (int axis = 0; axis < 3; ++axis) {
        if ((open >> (2 * axis) & 1u) != 0u) share = min(share, low[axis]);
        if ((open >> (2 * axis + 1) & 1u) != 0u) share = min(share, high[axis]);
    }
    return clamp(share, 0.0, 1.0);
}

// Irradiance [W/m²], and in alpha the ambient visibility; whether the surface sees none of its
// eight probes of any level.
vec4 light_of_probes(
    vec3 position, vec3 geometric_normal, vec3 shading_normal, out bool is_orphan) {
    is_orphan = false;
    vec4 sum = vec4(0.0);
    float left = 1.0;
    level_first = 0u;
    for (uint level = 0u; level < params.level_count; ++level) {
        level_row = lookup_rows[level];
        Cage cage = cage_around(position, geometric_normal);
        bool is_last = level + 1u == params.level_count;
        float share = is_last ? 1.0 : share_of_level(cage.moved);
        if (share > 0.0) {
            CageLight of_cage = light_of_cage(cage, position, geometric_normal, shading_normal);
            vec4 light = of_cage.sum / max(of_cage.weights, 1e-30);
            if (is_last) {
                light =
                    light_around_cage(cage, of_cage, position, geometric_normal, shading_normal);
                is_orphan = left == 1.0 && of_cage.seen < LEAST_SEEN;
            } else {
                share *= of_cage.present * clamp(of_cage.seen / LEAST_SEEN, 0.0, 1.0);
            }
            sum += left * share * light;
            left -= left * share;
        }
        if (left < 1e-3) break;
        uvec3 counts = level_row.counts.xyz;
        level_first += counts.x * counts.y * counts.z;
    }
    return sum / max(1.0 - left, 1e-3);
}

#endif
