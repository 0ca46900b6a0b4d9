// Probes of a lattice as spheres as the camera sees them, in front of surfaces by what they look
// up. A pixel's ray goes through the lattice from cell to cell (Amanatides & Woo 1987). The
// including pass declares `params` with `radius_m` and `view`, view_depth, normals, how probes are
// looked up, and `shown_of_probe`.
#ifndef LUMIVOX_PROBES_VIEW
#define LUMIVOX_PROBES_VIEW

// Spheres nearer to the eye than so many of their radii are not drawn: they would hide the scene.
const float NEAREST = 5.0;

// How far along a ray it meets the sphere of a probe [m]; infinitely far where it does not.
float distance_to_probe(uint probe, vec3 direction) {
    vec3 way = probe_places[probe].xyz - frame.eye_ws.xyz;
    float nearest = dot(way, direction);
    vec3 aside = way - nearest * direction;
    float chord = params.radius_m * params.radius_m - dot(aside, aside);
    float distance = nearest - sqrt(max(chord, 0.0));
    bool is_met = chord > 0.0 && distance > NEAREST * params.radius_m;
    return is_met ? distance : uintBitsToFloat(0x7f800000u);
}

// The first probe that a ray meets before `distance`, which becomes that of its sphere. A probe is
// in the cell around its place on the lattice, or in one beside it.
bool meets_probe(vec3 direction, inout float distance, out uint met) {
    ivec3 counts = ivec3(LOOKUP.counts.xyz);
    vec3 origin = (frame.eye_ws.xyz - LOOKUP.first.xyz) / LOOKUP.spacing.xyz + 0.5;
    vec3 along = direction / LOOKUP.spacing.xyz;
    along = mix(along, vec3(1e-20), equal(along, vec3(0.0)));
    bvec3 is_forward = greaterThan(along, vec3(0.0));
    vec3 low = vec3(-1.0), high = vec3(counts + 1);
    vec3 into = (mix(high, low, is_forward) - origin) / along;
    vec3 out_of = (mix(low, high, is_forward) - origin) / along;
    float entry = max(max(into.x, max(into.y, into.z)), 0.0);
    float end = min(out_of.x, min(out_of.y, out_of.z));
    bool is_met = false;
    met = 0u;
    if (entry >= end) return false;
    ivec3 cell = clamp(ivec3(floor(origin + entry * along)), ivec3(low), ivec3(high) - 1);
    ivec3 steps = mix(ivec3(-1), ivec3(1), is_forward);
    while (all(greaterThanEqual(cell, ivec3(low))) && all(lessThan(cell, ivec3(high)))) {
        for (uint i = 0u; i < 27u; ++i) {
            ivec3 at = cell + ivec3(i % 3u, i / 3u % 3u, i / 9u) - 1;
            if (any(lessThan(at, ivec3(0))) || any(greaterThanEqual(at, counts))) continue;
            uint probe = probe_at(uvec3(at));
            if (probe == NO_PROBE) continue;
            float to_probe = distance_to_probe(probe, direction);
            if (to_probe >= distance) continue;
            distance = to_probe;
            met = probe;
            is_met = true;
        }
        vec3 ends = (vec3(cell) + mix(vec3(0.0), vec3(1.0), is_forward) - origin) / along;
        int axis = ends.x <= ends.y && ends.x <= ends.z ? 0 : ends.y <= ends.z ? 1 : 2;
        if (distance <= ends[axis]) break;
        cell[axis] += steps[axis];
    }
    return is_met;
}

// What a surface shows.
vec4 shown_of_surface(Surface surface) {
    vec3 position = surface.position_ws, normal = surface.geometric_normal;
    if (params.view == IRRADIANCE) return light_of_probes(position, normal, surface.shading_normal);
    if (params.view != SIGHT) return vec4(0.0);
    Cage cage = cage_around(position, normal);
    float all_weights = 0.0, seen_weights = 0.0;
    for (uint corner = 0u; corner < 8u; ++corner) {
        uint probe = probe_at(cage.first + step_to(corner));
        if (probe == NO_PROBE) continue;
        vec2 sight = sight_of_probe(probe, position, cage.moved, normal);
        float share = share_of(cage, corner);
        all_weights += share * crushed(sight.x);
        seen_weights += share * crushed(sight.x * sight.y);
    }
    bool is_orphan = seen_weights < LEAST_SEEN;
    if (is_orphan) return vec4(1.0, 0.0, 0.0, 0.0);
    return vec4(vec3(seen_weights / all_weights), 1.0);
}

// What a pixel shows, but for images of maps.
vec4 shown_of_pixel(ivec2 pixel) {
    float depth_m = texelFetch(sampler2D(view_depth, nearest_clamp), pixel, 0).r;
    uvec2 packed = texelFetch(usampler2D(normals, nearest_clamp), pixel, 0).rg;
    bool is_surface = depth_m > 0.0;
    vec3 way = position_from_depth(pixel, is_surface ? depth_m : 1.0) - frame.eye_ws.xyz;
    vec3 direction = normalize(way);
    float distance = is_surface ? length(way) : uintBitsToFloat(0x7f800000u);
    uint probe;
    if (params.view != SIGHT && meets_probe(direction, distance, probe)) {
        vec3 at = frame.eye_ws.xyz + distance * direction;
        return shown_of_probe(probe, normalize(at - probe_places[probe].xyz));
    }
    if (!is_surface) return vec4(0.0);
    Surface surface;
    surface.position_ws = frame.eye_ws.xyz + way;
    surface.geometric_normal = unpack_unit(packed.x);
    surface.shading_normal = unpack_unit(packed.y);
    return shown_of_surface(surface);
}

#endif
