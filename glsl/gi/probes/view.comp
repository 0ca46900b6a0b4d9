#version 460
#extension GL_GOOGLE_include_directive : require
// probes.view: probes as spheres as the camera sees them, in front of surfaces by what they look
// up; or the images of maps. A thread a pixel; its ray goes through the lattice from cell to cell
// (Amanatides & Woo 1987).
layout(local_size_x = 8, local_size_y = 8) in;

layout(set = 1, binding = 0) uniform texture2D view_depth;
layout(set = 1, binding = 1) uniform utexture2D normals;
layout(set = 1, binding = 2, rgba32f) uniform restrict writeonly image2D seen;

#include "gi/probes/lookup_row.glsl"

layout(push_constant) uniform ViewParams {
    LookupRow lookup;
    float radius_m;       // of a sphere
    float farthest_m;     // that a probe moves
    float reach;          // the farthest that a probe sees [cells]
    uint view;            // one of gi::probes::view::VIEWS
} params;

#include "shared/gbuffer.glsl"
#define LOOKUP_BINDING 3
#define LOOKUP_CONSTANT 0
#include "gi/probes/lookup.glsl"

const uint IRRADIANCE = 0u, DISTANCES = 1u, MOVES = 2u, SIGHT = 3u, IRRADIANCE_ATLAS = 4u;

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
    ivec3 counts = ivec3(params.lookup.counts.xyz);
    vec3 origin = (frame.eye_ws.xyz - params.lookup.first.xyz) / params.lookup.spacing.xyz + 0.5;
    vec3 along = direction / params.lookup.spacing.xyz;
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

// What a sphere shows where its normal points to `normal`.
vec4 shown_of_probe(uint probe, vec3 normal) {
    vec3 place = probe_places[probe].xyz;
    if (params.view == DISTANCES)
        return map_at(probe_moments, probe, MOMENT_TEXELS, normal).rrra / params.reach;
    if (params.view == MOVES) {
        uvec3 counts = params.lookup.counts.xyz;
        uint row = probe / counts.x;
        vec3 at = vec3(probe % counts.x, row % counts.y, row / counts.y);
        vec3 home = params.lookup.first.xyz + params.lookup.spacing.xyz * at;
        return vec4((place - home) / params.farthest_m, 1.0);
    }
    return light_of_probe(probe, place, normal);
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
        vec2 sight = sight_of_probe(probe, position, cage.moved, normal);
        float share = share_of(cage, corner);
        all_weights += share * crushed(sight.x);
        seen_weights += share * crushed(sight.x * sight.y);
    }
    bool is_orphan = seen_weights < LEAST_SEEN;
    return is_orphan ? vec4(1.0, 0.0, 0.0, 0.0) : vec4(vec3(seen_weights / all_weights), 1.0);
}

// A texel of an image of maps, which fills the picture as far as its shape allows.
vec4 shown_of_atlas(ivec2 pixel) {
    bool is_light = params.view == IRRADIANCE_ATLAS;
    ivec2 size = is_light ? textureSize(sampler2D(probe_irradiance, nearest_clamp), 0)
                          : textureSize(sampler2D(probe_moments, nearest_clamp), 0);
    vec2 picture = vec2(frame.size_px.xy), texels = vec2(size) / picture;
    ivec2 texel = ivec2((vec2(pixel) + 0.5) * max(texels.x, texels.y));
    if (any(greaterThanEqual(texel, size))) return vec4(0.0);
    if (!is_light) {
        vec2 moments = texelFetch(sampler2D(probe_moments, nearest_clamp), texel, 0).rg;
        float deviation = sqrt(abs(moments.y - moments.x * moments.x));
        return vec4(vec2(moments.x, deviation) / params.reach, 0.0, 1.0);
    }
    ivec2 map = texel / int(IRRADIANCE_TEXELS + 2u);
    uint probe = uint(map.x) + uint(map.y) * params.lookup.columns;
    uvec3 counts = params.lookup.counts.xyz;
    if (probe >= counts.x * counts.y * counts.z) return vec4(0.0);
    vec4 light = texelFetch(sampler2D(probe_irradiance, nearest_clamp), texel, 0);
    return vec4(light.rgb * probe_scales[probe], light.a);
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, ivec2(frame.size_px.xy)))) return;
    if (params.view >= IRRADIANCE_ATLAS) {
        imageStore(seen, pixel, shown_of_atlas(pixel));
        return;
    }
    float depth_m = texelFetch(sampler2D(view_depth, nearest_clamp), pixel, 0).r;
    uvec2 packed = texelFetch(usampler2D(normals, nearest_clamp), pixel, 0).rg;
    bool is_surface = depth_m > 0.0;
    vec3 way = position_from_depth(pixel, is_surface ? depth_m : 1.0) - frame.eye_ws.xyz;
    vec3 direction = normalize(way);
    float distance = is_surface ? length(way) : uintBitsToFloat(0x7f800000u);
    vec4 result = vec4(0.0);
    uint probe;
    if (params.view != SIGHT && meets_probe(direction, distance, probe)) {
        vec3 at = frame.eye_ws.xyz + distance * direction;
        result = shown_of_probe(probe, normalize(at - probe_places[probe].xyz));
    } else if (is_surface) {
        Surface surface;
        surface.position_ws = frame.eye_ws.xyz + way;
        surface.geometric_normal = unpack_unit(packed.x);
        surface.shading_normal = unpack_unit(packed.y);
        result = shown_of_surface(surface);
    }
    imageStore(seen, pixel, result);
}
