// Rays through the maps of a light field (McGuire et al. 2017; docs/gi/probes.md). The including
// pass declares FIELD_BINDING, FIELD_CONSTANT, and `params` with a LookupRow `lookup` and
// `thickness_m`.
#ifndef LUMIVOX_LIGHT_FIELD_MARCH
#define LUMIVOX_LIGHT_FIELD_MARCH

#include "gi/probes/field_maps.glsl"

layout(constant_id = FIELD_CONSTANT + 1) const uint THICKNESS_TRACE = 0;   // 1: as published

const uint MET = 0u, ESCAPED = 1u, UNKNOWN = 2u;
const float FAR = 1.0 / 0.0;

// A ray in the frame of a probe [cells].
struct FieldRay {
    vec3 origin;
    vec3 direction;
};

// A part of a ray within one texel, from `begin` to `end` [cells].
struct FieldStep {
    ivec2 texel;
    float begin;
    float end;
    bool is_first;   // where the ray starts
};

// What a ray meets in a texel: where it crosses the plane of what the probe sees there. A ray that
// is behind that plane is where the probe does not see. `at`: how far along the ray [cells].
uint meets_plane(ivec2 map, FieldRay ray, FieldStep part, out float at) {
    FieldTexel seen = surface_at(map, part.texel);
    at = part.begin;
    if (isinf(seen.distance)) return ESCAPED;
    vec3 to_texel = direction_of_texel(vec2(part.texel), FIELD_TEXELS);
    float slack = TEXEL_SLACK * texel_size() * seen.distance;
    float towards = dot(seen.normal, ray.direction);
    float above = dot(seen.normal, ray.origin - seen.distance * to_texel);
    float above_begin = above + part.begin * towards;
    if (above_begin < -slack) return UNKNOWN;
    // Where it starts it stands on a surface, beside which a texel may show another.
    if (towards >= 0.0 || (part.is_first && above_begin <= 0.0)) return ESCAPED;
    at = max(-above / towards, part.begin);
    return at <= part.end ? MET : ESCAPED;
}

// The least thickness of surfaces [m].
const float LEAST_THICKNESS = 0.03;

// The same as published: surfaces have a thickness, and a ray that goes deeper is where the probe
// does not see.
uint meets_thickness(ivec2 map, FieldRay ray, FieldStep part, out float at) {
    FieldTexel seen = surface_at(map, part.texel);
    at = part.begin;
    float first = length(ray.origin + part.begin * ray.direction);
    float last = isinf(part.end) ? FAR : length(ray.origin + part.end * ray.direction);
    if (isinf(seen.distance) || max(first, last) < seen.distance) return ESCAPED;
    float cell_m = params.lookup.spacing.w;
    vec3 to_texel = direction_of_texel(vec2(part.texel), FIELD_TEXELS);
    at = max(dot(seen.distance * to_texel - ray.origin, ray.direction), part.begin);
    float along = max(dot(ray.direction, to_texel), 0.0);
    float across = 2.0 - abs(dot(ray.direction, seen.normal));
    float thickness_m = LEAST_THICKNESS
        + (params.thickness_m - LEAST_THICKNESS) * along * across
            * clamp(at * cell_m * 0.1, 0.05, 1.0);
    bool is_hit = min(first, last) < seen.distance + thickness_m / cell_m
        && dot(seen.normal, ray.direction) < 0.0;
    return is_hit ? MET : UNKNOWN;
}

// Where a ray is in the map of a probe, [texels] as (first + t change) / (first_size + t
// size_change), within the octant of signs `side`.
struct MapLine {
    vec2 first;
    vec2 change;
    float first_size;
    float size_change;
};

MapLine line_in(FieldRay ray, vec3 side) {
    vec3 a = side * ray.origin, b = side * ray.direction;
    float a_size = a.x + a.y + a.z, b_size = b.x + b.y + b.z;
    vec2 u = side.xy * (side.z > 0.0 ? a.xy : vec2(a_size) - a.yx);
    vec2 v = side.xy * (side.z > 0.0 ? b.xy : vec2(b_size) - b.yx);
    float half_edge = 0.5 * float(FIELD_TEXELS);
    return MapLine(half_edge * (u + a_size), half_edge * (v + b_size), a_size, b_size);
}

ivec2 texel_of_line(MapLine line, float t) {
    vec2 place = isinf(t) ? line.change / max(line.size_change, 1e-20)
                          : (line.first + t * line.change)
                              / max(line.first_size + t * line.size_change, 1e-20);
    return clamp(ivec2(floor(place)), ivec2(0), ivec2(FIELD_TEXELS - 1u));
}

// Follows a ray through the map of a probe from `t` [cells], octant by octant, in each of which it
// is a straight line. `t` becomes where it meets a surface, or where the probe does not see.
uint march_probe(uint probe, FieldRay ray, inout float t) {
    ivec2 map = field_map(probe, params.lookup.columns, FIELD_TEXELS);
    // Where it crosses the planes that divide octants.
    vec3 crossings = mix(-ray.origin / ray.direction, vec3(FAR), equal(ray.direction, vec3(0.0)));
    bool is_first = t == 0.0;
    for (uint octant = 0u; octant < 4u; ++octant) {
        bvec3 is_ahead = greaterThan(crossings, vec3(t));
        vec3 heading = mix(ray.direction, ray.origin, equal(ray.direction, vec3(0.0)));
        vec3 side = mix(vec3(-1.0), vec3(1.0), greaterThanEqual(heading, vec3(0.0)));
        bvec3 turns = bvec3(is_ahead.x && ray.direction.x != 0.0,
            is_ahead.y && ray.direction.y != 0.0, is_ahead.z && ray.direction.z != 0.0);
        side = mix(side, -side, turns);
        vec3 next = mix(vec3(FAR), crossings, is_ahead);
        float end = min(next.x, min(next.y, next.z));
        MapLine line = line_in(ray, side);
        ivec2 texel = texel_of_line(line, t), last = texel_of_line(line, end);
        ivec2 steps = sign(last - texel);
        for (uint i = 0u; i < 2u * FIELD_TEXELS; ++i) {
            vec2 border = vec2(texel + max(steps, ivec2(0)));
            vec2 leaves = (border * line.first_size - line.first)
                / (line.change - border * line.size_change);
            float begin = t;
            float to_x = texel.x == last.x ? FAR : leaves.x;
            float to_y = texel.y == last.y ? FAR : leaves.y;
            bool leaves_x = to_x < to_y;
            float leave = leaves_x ? to_x : to_y;
            // Rounding may lead back, or beyond the octant.
            t = leave > begin ? min(leave, end) : begin;
            if (texel == last) t = end;
            float at;
            FieldStep part = FieldStep(texel, begin, t, is_first);
            uint met;
            if (THICKNESS_TRACE != 0u) {
                met = meets_thickness(map, ray, part, at);
            } else {
                met = meets_plane(map, ray, part, at);
            }
            is_first = false;
            if (met != ESCAPED) {
                t = at;
                return met;
            }
            if (texel == last) break;
            if (leaves_x) {
                texel.x += steps.x;
            } else {
                texel.y += steps.y;
            }
        }
        t = end;
        if (isinf(end)) break;
    }
    return ESCAPED;
}

#endif
