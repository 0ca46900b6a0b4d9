// The light that comes to a surface along rays through a light field. The including pass follows
// paths, declares FieldGatherParams, and the numbers of its next bindings and constants,
// FIELD_BINDING and FIELD_CONSTANT.
#ifndef LUMIVOX_LIGHT_FIELD_RAYS
#define LUMIVOX_LIGHT_FIELD_RAYS

#define LOOKUP_BINDING FIELD_BINDING + 2
#define LOOKUP_CONSTANT FIELD_CONSTANT + 4
#define REFLECTS_CONSTANT FIELD_CONSTANT + 3
#define TRACES
#include "gi/probes/lookup.glsl"
#include "gi/probes/light_field/march.glsl"
#include "gi/probes/reflected.glsl"
#include "gi/shared/paths/start.glsl"

// 1: rays through the triangles answer what no probe knows; 0: the irradiance of probes
layout(constant_id = FIELD_CONSTANT + 2) const uint UNKNOWN_BY_RAYS = 1;

// Two numbers of [0, 1) that a pixel's directions begin with; without a pattern anywhere.
vec2 offset_of(ivec2 pixel) {
    bool is_alone = (params.pattern & 0xffffu) == 0x101u;
    return is_alone ? unit_numbers(pcg3(uvec3(pixel, frame.walk.x))).xy
                    : interleaved_offset(pixel, params.pattern, frame.walk.x);
}

// The probes around a surface, and where its rays start.
struct FieldStart {
    uvec3 first;      // of the eight probes
    uint nearest;     // of them
    vec3 origin;      // [m]
};

FieldStart field_start(Surface surface) {
    Cage cage = cage_around(surface.position_ws, surface.geometric_normal);
    FieldStart start = FieldStart(cage.first, 0u, vec3(0.0));
    float least = FAR;
    for (uint corner = 0u; corner < 8u; ++corner) {
        vec3 way = probe_places[probe_at(cage.first + step_to(corner))].xyz - surface.position_ws;
        float distance = length(way);
        if (distance < least) {
            least = distance;
            start.nearest = corner;
        }
    }
    start.origin = surface.position_ws
        + params.origin_bias * texel_size() * least * surface.geometric_normal;
    return start;
}

// What a ray brings that is scattered with a density [1/sr] and meets nothing.
vec4 escaped_along(vec3 direction, float density) {
    return vec4(environment_of_scattered(direction, density, params.ray_count), 1.0);
}

// Radiance that comes along `direction` [W/(m² sr)], scattered with a density [1/sr], and 1 in
// alpha where nothing is met. The probes are asked one after the other, each from where the last
// one did not see on (McGuire et al. 2017).
vec4 light_along_field(Surface surface, FieldStart start, vec3 direction, float density) {
    float cell_m = params.lookup.spacing.w, t = 0.0;
    for (uint i = 0u; i < 8u; ++i) {
        uint corner = (start.nearest + 3u * i) & 7u;
        uint probe = probe_at(start.first + step_to(corner));
        // A probe behind the surface does not see where the ray starts; beside a thin wall it would
        // take what it sees of the other side for what is there.
        vec3 way = probe_places[probe].xyz - surface.position_ws;
        if (t == 0.0 && dot(surface.geometric_normal, way) <= 0.0) continue;
        FieldRay ray = FieldRay((start.origin - probe_places[probe].xyz) / cell_m, direction);
        uint met = march_probe(probe, ray, t);
        if (met == ESCAPED) return escaped_along(direction, density);
        if (met == MET) return vec4(seen_of_field(probe, ray.origin + t * direction).rgb, 0.0);
    }
    if (UNKNOWN_BY_RAYS == 0u) {
        vec4 light = light_of_probes(
            surface.position_ws, surface.geometric_normal, surface.shading_normal);
        return light / vec4(vec3(PI), 1.0);
    }
    vec3 origin = surface.position_ws
        + start_distance(surface.position_ws) * surface.geometric_normal;
    RayHit hit = closest_hit(origin, direction, NO_TRIANGLE);
    if (hit.triangle == NO_TRIANGLE) return escaped_along(direction, density);
    return vec4(light_of_hit(hit.triangle, hit.at, direction), 0.0);
}

#endif
