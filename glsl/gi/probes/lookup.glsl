// The light of a surface from the probes around it (Majercik et al. 2019; docs/gi/probes.md). The
// including pass declares `params` with a LookupRow `lookup`, LOOKUP_BINDING and LOOKUP_CONSTANT.
#ifndef LUMIVOX_PROBES_LOOKUP
#define LUMIVOX_PROBES_LOOKUP

#include "gi/probes/atlas.glsl"

layout(constant_id = LOOKUP_CONSTANT) const uint IRRADIANCE_TEXELS = 8;
layout(constant_id = LOOKUP_CONSTANT + 1) const uint MOMENT_TEXELS = 16;
layout(constant_id = LOOKUP_CONSTANT + 2) const uint VISIBILITY = 2;   // what keeps probes out

const uint VISIBILITY_FACING = 1u, VISIBILITY_MOMENTS = 2u;

layout(std430, set = 1, binding = LOOKUP_BINDING) restrict readonly buffer ProbePlaces {
    vec4 probe_places[];
};
// of each probe: irradiance of a stored 1 [W/m²]
layout(std430, set = 1, binding = LOOKUP_BINDING + 1) restrict readonly buffer ProbeScales {
    float probe_scales[];
};
layout(set = 1, binding = LOOKUP_BINDING + 2) uniform texture2D probe_irradiance;
layout(set = 1, binding = LOOKUP_BINDING + 3) uniform texture2D probe_moments;

uint probe_at(uvec3 place) {
    uvec3 counts = params.lookup.counts.xyz;
    return place.x + counts.x * (place.y + counts.y * place.z);
}

vec4 map_at(texture2D image, uint probe, uint edge, vec3 direction) {
    vec2 size = vec2(textureSize(sampler2D(image, linear_clamp), 0));
    vec2 place = place_in_map(map_of(probe, params.lookup.columns, edge), edge, direction);
    return textureLod(sampler2D(image, linear_clamp), place / size, 0.0);
}

// The share of a probe's neighbourhood that sees as far as `distance` (cells), by Chebyshev's
// inequality (Donnelly & Lauritzen 2006), cubed.
float chebyshev(vec2 moments, float distance) {
    if (distance <= moments.x) return 1.0;
    float variance = abs(moments.y - moments.x * moments.x), beyond = distance - moments.x;
    float share = variance / (variance + beyond * beyond);
    return share * share * share;
}

// How much a probe counts for a surface, before the lattice's own weight.
float weight_of_probe(uint probe, vec3 position, vec3 moved, vec3 normal) {
    if (VISIBILITY == 0u) return 1.0;
    vec3 place = probe_places[probe].xyz, way = place - position;
    float facing = dot(normal, way) * inversesqrt(max(dot(way, way), 1e-30)) * 0.5 + 0.5;
    float weight = facing * facing + 0.2;
    if (VISIBILITY == VISIBILITY_MOMENTS) {
        vec3 seen = moved - place;
        float distance = length(seen);
        vec2 moments = map_at(probe_moments, probe, MOMENT_TEXELS, seen / max(distance, 1e-30)).rg;
        float share = chebyshev(moments, distance / params.lookup.spacing.w);
        weight *= max(share, params.lookup.weight_floor);
    }
    // Small weights are made smaller still, and go to 0 smoothly.
    float crush = params.lookup.crush;
    return weight < crush ? weight * weight * weight / (crush * crush) : weight;
}

// Irradiance [W/m²], and in alpha the ambient visibility.
vec4 light_of_probes(vec3 position, vec3 geometric_normal, vec3 shading_normal) {
    LookupRow row = params.lookup;
    vec3 moved = position + row.normal_bias_m * geometric_normal;
    vec3 last = vec3(row.counts.xyz) - 1.0;
    vec3 place = clamp((moved - row.first.xyz) / row.spacing.xyz, vec3(0.0), last);
    uvec3 cell = uvec3(min(floor(place), last - 1.0));
    vec3 between = place - vec3(cell);
    vec4 sum = vec4(0.0);
    float weights = 0.0;
    for (uint corner = 0u; corner < 8u; ++corner) {
        uvec3 step = uvec3(corner, corner >> 1, corner >> 2) & 1u;
        uint probe = probe_at(cell + step);
        vec3 t = max(mix(1.0 - between, between, vec3(step)), 1e-3);
        float weight = t.x * t.y * t.z
            * weight_of_probe(probe, position, moved, geometric_normal);
        vec4 light = map_at(probe_irradiance, probe, IRRADIANCE_TEXELS, shading_normal);
        sum += weight * vec4(light.rgb * probe_scales[probe], light.a);
        weights += weight;
    }
    return sum / max(weights, 1e-30);
}

#endif
