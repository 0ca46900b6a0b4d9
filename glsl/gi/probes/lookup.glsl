// The light of a surface from the probes around it (Majercik et al. 2019; docs/gi/probes.md). The
// including pass declares `params` with a LookupRow `lookup`, or another one as LOOKUP; and
// LOOKUP_BINDING and LOOKUP_CONSTANT; one that can trace rays also TRACES. With SPARSE not all
// probes are there, and it has a `probe_at` and a `light_of_probes` of its own.
#ifndef LUMIVOX_PROBES_LOOKUP
#define LUMIVOX_PROBES_LOOKUP

#include "gi/probes/atlas.glsl"
#include "gi/probes/cage.glsl"
#include "shared/luminance.glsl"
#include "gi/shared/sh.glsl"

layout(constant_id = LOOKUP_CONSTANT) const uint IRRADIANCE_TEXELS = 8;
layout(constant_id = LOOKUP_CONSTANT + 1) const uint MOMENT_TEXELS = 16;
layout(constant_id = LOOKUP_CONSTANT + 2) const uint VISIBILITY = 2;   // what keeps probes out
layout(constant_id = LOOKUP_CONSTANT + 3) const uint RINGS = 2;        // of further probes
layout(constant_id = LOOKUP_CONSTANT + 4) const uint HAS_GRADIENTS = 0;
layout(constant_id = LOOKUP_CONSTANT + 5) const uint IS_SH = 0;   // 1: harmonics in place of maps

const uint VISIBILITY_NONE = 0u, VISIBILITY_MOMENTS = 2u, VISIBILITY_RAYS = 3u;

layout(std430, set = 1, binding = LOOKUP_BINDING) restrict readonly buffer ProbePlaces {
    vec4 probe_places[];
};
// of each probe: irradiance of a stored 1 [W/m²]
layout(std430, set = 1, binding = LOOKUP_BINDING + 1) restrict readonly buffer ProbeScales {
    float probe_scales[];
};
layout(set = 1, binding = LOOKUP_BINDING + 2) uniform texture2D probe_irradiance;
layout(set = 1, binding = LOOKUP_BINDING + 3) uniform texture2D probe_moments;
layout(set = 1, binding = LOOKUP_BINDING + 4) uniform texture2D probe_gradients;

vec4 map_at(texture2D image, uint probe, uint edge, vec3 direction) {
    vec2 size = vec2(textureSize(sampler2D(image, linear_clamp), 0));
    vec2 place = place_in_map(map_of(probe, LOOKUP.columns, edge), edge, direction);
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

// What (4) makes of a probe for a surface. x: by the side of the surface that it is on; y: the
// share of it that the surface sees.
vec2 sight_of_probe(uint probe, vec3 position, vec3 moved, vec3 normal) {
    if (VISIBILITY == VISIBILITY_NONE) return vec2(1.0);
    vec3 place = probe_places[probe].xyz, way = place - position;
    float facing = dot(normal, way) * inversesqrt(max(dot(way, way), 1e-30)) * 0.5 + 0.5;
    vec3 seen = moved - place;
    float distance = length(seen), share = 1.0;
    vec3 direction = seen / max(distance, 1e-30);
    if (VISIBILITY == VISIBILITY_MOMENTS) {
        vec2 moments = map_at(probe_moments, probe, MOMENT_TEXELS, direction).rg;
        share = chebyshev(moments, distance / LOOKUP.spacing.w);
    }
#ifdef TRACES
    if (VISIBILITY == VISIBILITY_RAYS) {
        bool is_hidden = is_occluded(moved, -direction, distance, NO_TRIANGLE, NO_TRIANGLE);
        share = is_hidden ? 0.0 : 1.0;
    }
#endif
    return vec2(facing * facing + 0.2, share);
}

// Small weights are made smaller still, and go to 0 smoothly.
float crushed(float weight) {
    float crush = LOOKUP.crush;
    return weight < crush ? weight * weight * weight / (crush * crush) : weight;
}

// The same of spherical harmonics, a coefficient of radiance a texel.
vec4 light_of_harmonics(uint probe, vec3 normal) {
    ivec2 first = map_of(probe, LOOKUP.columns, 1u);
    float lobe[9] = sh_zonal3(SH_COSINE, normal);
    vec4 sum = vec4(0.0);
    for (int i = 0; i < 9; ++i) {
        ivec2 texel = first + ivec2(i % 3, i / 3);
        sum += lobe[i] * texelFetch(sampler2D(probe_irradiance, nearest_clamp), texel, 0);
    }
    return max(sum, vec4(0.0)) * vec4(vec3(1.0), 1.0 / PI);
}

// Where gradients lead, irradiance is at most so many times that of the probe.
const float MOST_CHANGE = 3.0;

// Irradiance of a probe [W/m²] as it is at a place near it, and in alpha the ambient visibility.
vec4 light_of_probe(uint probe, vec3 position, vec3 normal) {
    vec4 light;
    if (IS_SH != 0u) {
        light = light_of_harmonics(probe, normal);
    } else {
        light = map_at(probe_irradiance, probe, IRRADIANCE_TEXELS, normal);
    }
    if (HAS_GRADIENTS != 0u) {
        vec3 gradient = map_at(probe_gradients, probe, IRRADIANCE_TEXELS, normal).xyz;
        vec3 way = (position - probe_places[probe].xyz) / LOOKUP.spacing.w;
        float change = dot(gradient, way) / max(luminance_of(light.rgb), 1e-30);
        light.rgb *= clamp(1.0 + change, 0.0, MOST_CHANGE);
    }
    return vec4(light.rgb * probe_scales[probe], light.a);
}

// Below this sum of weights of the eight probes around a place, without their floor, further ones
// are asked.
const float LEAST_SEEN = 1e-3;

// The mean of the probes that a surface sees in the first shell of probes around its eight that has
// some; `otherwise` where none has.
vec4 light_of_further(uvec3 first, vec3 position, vec3 moved, vec3 geometric_normal,
    vec3 shading_normal, vec4 otherwise) {
    float cell_m = LOOKUP.spacing.w;
    for (uint ring = 1u; ring <= RINGS; ++ring) {
        uint edge = 2u + 2u * ring;
        vec4 sum = vec4(0.0);
        float weights = 0.0;
        for (uint i = 0u; i < edge * edge * edge; ++i) {
            uvec3 step = uvec3(i, i / edge, i / (edge * edge)) % edge;
            ivec3 at = ivec3(first + step) - int(ring);
            bool is_inner = all(greaterThan(step, uvec3(0u)))
                && all(lessThan(step, uvec3(edge - 1u)));
            bool is_there = all(greaterThanEqual(at, ivec3(0)))
                && all(lessThan(at, ivec3(LOOKUP.counts.xyz)));
            if (is_inner || !is_there) continue;
            uint probe = probe_at(uvec3(at));
            if (probe == NO_PROBE) continue;
            vec2 sight = sight_of_probe(probe, position, moved, geometric_normal);
            vec3 way = (probe_places[probe].xyz - position) / cell_m;
            float weight = crushed(sight.x * sight.y) / max(dot(way, way), 1e-2);
            sum += weight * light_of_probe(probe, position, shading_normal);
            weights += weight;
        }
        if (weights >= LEAST_SEEN) return sum / weights;
    }
    return otherwise;
}

// What the eight probes of a cage have for a surface.
struct CageLight {
    vec4 sum;         // irradiance [W/m²] and ambient visibility, by weight
    float weights;
    float seen;       // weights without their floor
    float present;    // trilinear weights of probes that are there
};

CageLight light_of_cage(Cage cage, vec3 position, vec3 geometric_normal, vec3 shading_normal) {
    CageLight light = CageLight(vec4(0.0), 0.0, 0.0, 0.0);
    for (uint corner = 0u; corner < 8u; ++corner) {
        uint probe = probe_at(cage.first + step_to(corner));
        if (probe == NO_PROBE) continue;
        vec2 sight = sight_of_probe(probe, position, cage.moved, geometric_normal);
        float share = share_of(cage, corner);
        float weight = share * crushed(sight.x * max(sight.y, LOOKUP.weight_floor));
        light.sum += weight * light_of_probe(probe, position, shading_normal);
        light.weights += weight;
        light.seen += share * crushed(sight.x * sight.y);
        light.present += share;
    }
    return light;
}

// The mean of the eight; of further ones where all eight are hidden.
vec4 light_around_cage(Cage cage, CageLight of_cage, vec3 position, vec3 geometric_normal,
    vec3 shading_normal) {
    vec4 light = of_cage.sum / max(of_cage.weights, 1e-30);
    if (VISIBILITY == VISIBILITY_MOMENTS) {
        if (of_cage.seen < LEAST_SEEN) {
            vec4 further = light_of_further(
                cage.first, position, cage.moved, geometric_normal, shading_normal, light);
            light = mix(further, light, of_cage.seen / LEAST_SEEN);
        }
    }
    return light;
}

// Irradiance [W/m²], and in alpha the ambient visibility; whether the surface sees none of its
// eight probes.
vec4 light_of_probes(
    vec3 position, vec3 geometric_normal, vec3 shading_normal, out bool is_orphan);

vec4 light_of_probes(vec3 position, vec3 geometric_normal, vec3 shading_normal) {
    bool is_orphan;
    return light_of_probes(position, geometric_normal, shading_normal, is_orphan);
}

#ifndef SPARSE
vec4 light_of_probes(
    vec3 position, vec3 geometric_normal, vec3 shading_normal, out bool is_orphan) {
    Cage cage = cage_around(position, geometric_normal);
    CageLight of_cage = light_of_cage(cage, position, geometric_normal, shading_normal);
    is_orphan = of_cage.seen < LEAST_SEEN;
    return light_around_cage(cage, of_cage, position, geometric_normal, shading_normal);
}
#endif

#endif
