#version 460
#extension GL_GOOGLE_include_directive : require
// light_field.reflect: indirect specular radiance L_s of glossy surfaces by the split sum (Karis
// 2013): light that is averaged over lobes beforehand, times what the lobe reflects. Alpha is 1
// where rays are to mirror instead: on surfaces that are too rough for the first, and not rough
// enough for light from all sides, and where no probe sees what is mirrored.
layout(local_size_x = 8, local_size_y = 8) in;

#include "render/bvh/bindings.glsl"

layout(set = 1, binding = 5) uniform texture2D view_depth;
layout(set = 1, binding = 6) uniform utexture2D normals;
layout(set = 1, binding = 7) uniform texture2D specular;
layout(set = 1, binding = 8, rgba32f) uniform restrict writeonly image2D indirect_specular;
layout(std430, set = 1, binding = 9) restrict readonly buffer ProbePlaces { vec4 probe_places[]; };
#define FIELD_BINDING 10
layout(set = 1, binding = 12) uniform utexture2D field_prefiltered;
layout(set = 1, binding = 13) uniform texture2D split_sum;

#include "gi/probes/lookup_row.glsl"

layout(push_constant) uniform ReflectParams {
    LookupRow lookup;
    vec4 low;         // xyz: smallest corner of the box that reflections are shifted in [m]
    vec4 high;        // xyz: largest
    uint rows;        // of maps
    uint parallax;    // from where probes show what is mirrored
} params;

#include "shared/gbuffer.glsl"
#include "render/bvh/traverse.glsl"
#include "render/bvh/start.glsl"
#include "gi/probes/cage.glsl"
#define FIELD_CONSTANT 3
#include "gi/probes/field_maps.glsl"
#include "gi/probes/prefiltered.glsl"
#include "gi/shared/split_sum.glsl"

// gi::probes::prefiltered::Parallax
const uint PARALLAX_NONE = 0u, PARALLAX_BOX = 1u, PARALLAX_DISTANCE = 2u;

// From here on light from all sides is nearer to what surfaces mirror than any lobe of probes.
const float FROM_ALL_SIDES = 0.65;

// Below this share of probes that see what is mirrored rays mirror.
const float LEAST_SEEN = 0.02;

// Where a mirror would show what a surface mirrors.
struct Mirrored {
    vec3 direction;
    float distance;     // [m], infinite where that is told by direction alone
    bool is_met;        // a surface is there
};

Mirrored mirrored_by(Surface surface, vec3 direction) {
    Mirrored there = Mirrored(direction, uintBitsToFloat(0x7f800000u), false);
    if (params.parallax == PARALLAX_BOX) {
        vec3 sides = mix(params.low.xyz, params.high.xyz, greaterThan(direction, vec3(0.0)));
        vec3 t = mix((sides - surface.position_ws) / direction, vec3(there.distance),
            equal(direction, vec3(0.0)));
        there.distance = max(min(t.x, min(t.y, t.z)), 0.0);
    } else if (params.parallax == PARALLAX_DISTANCE) {
        vec3 origin = surface.position_ws
            + start_distance(surface.position_ws) * surface.geometric_normal;
        RayHit hit = closest_hit(origin, direction, NO_TRIANGLE);
        there.is_met = hit.triangle != NO_TRIANGLE;
        if (there.is_met) there.distance = hit.t;
    }
    return there;
}

// How much of the four texels around a direction sees as far as a place in the probe's frame, or
// without end.
float sees_past(uint probe, vec3 place, bool has_no_end) {
    FieldCorners corners = corners_around(probe, normalize(place));
    float sees = 0.0;
    for (int corner = 0; corner < 4; ++corner) {
        float share;
        ivec2 texel = corner_texel(corners, corner, share);
        FieldTexel seen = surface_at(corners.map, texel);
        if (isinf(seen.distance)) {
            sees += share;
        } else if (!has_no_end) {
            vec2 above = above_texel(seen, texel, place);
            if (above.x >= -above.y) sees += share;
        }
    }
    return sees;
}

// The same of the surface itself, a little off it; a probe behind it sees the other side.
float sees_surface(uint probe, Surface surface, Cage cage) {
    vec3 place = probe_places[probe].xyz;
    if (dot(surface.geometric_normal, place - surface.position_ws) <= 0.0) return 0.0;
    return sees_past(probe, (cage.moved - place) / params.lookup.spacing.w, false);
}

// Radiance [W/(m² sr)] between the four texels of a map around a direction.
vec3 light_between(utexture2D image, ivec2 map, int edge, vec3 direction) {
    vec2 at = (octahedral_from_unit(direction) * 0.5 + 0.5) * float(edge) - 0.5;
    ivec2 low = ivec2(floor(at));
    vec2 between = at - vec2(low);
    vec3 sum = vec3(0.0);
    for (int corner = 0; corner < 4; ++corner) {
        ivec2 step = ivec2(corner & 1, corner >> 1);
        vec2 share = mix(1.0 - between, between, vec2(step));
        ivec2 texel = map + texel_beyond(low + step, edge);
        uint packed = texelFetch(usampler2D(image, nearest_clamp), texel, 0).r;
        sum += share.x * share.y * unpack_rgbe(packed);
    }
    return sum;
}

vec3 light_towards(uint probe, vec3 direction) {
    ivec2 map = field_map(probe, params.lookup.columns, FIELD_TEXELS);
    return light_between(field_radiance, map, int(FIELD_TEXELS), direction);
}

vec3 light_in_level(uint probe, uint level, vec3 direction) {
    int edge = int(FIELD_TEXELS);
    ivec2 map = map_in_level(probe, level, params.lookup.columns, params.rows, edge);
    return light_between(field_prefiltered, map, edge_of_level(level, edge), direction);
}

// What a lobe around `way` brings of what a probe sees; `sharp`: what a mirror would.
vec3 light_of_lobe(uint probe, vec3 way, float roughness, vec3 sharp) {
    vec3 direction = normalize(way);
    // Lobes are as wide as α is, the square of roughness.
    float share = min(roughness / ROUGHEST, 1.0), width = 4.0 * share * share;
    vec3 half_rough = light_in_level(probe, HALF_ROUGH, direction);
    if (width <= 1.0) return mix(sharp, half_rough, width);
    return mix(half_rough, light_in_level(probe, ROUGH, direction), (width - 1.0) / 3.0);
}

// The mean of a lobe around `direction`, and in alpha the share of the probes that see it.
vec4 light_of_lobes(Surface surface, vec3 direction, float roughness) {
    Cage cage = cage_around(surface.position_ws, surface.geometric_normal);
    Mirrored there = mirrored_by(surface, direction);
    float cell_m = params.lookup.spacing.w;
    bool is_far = isinf(there.distance);
    vec4 sum = vec4(0.0);
    float weights = 0.0;
    for (uint corner = 0u; corner < 8u; ++corner) {
        uint probe = probe_at(cage.first + step_to(corner));
        vec3 place = probe_places[probe].xyz;
        vec3 way = direction;
        float at_probe = roughness;
        if (!is_far) {
            way = (surface.position_ws + there.distance * direction - place) / cell_m;
            at_probe *= sqrt(there.distance / max(length(way) * cell_m, 1e-6));
        }
        vec4 sharp;
        if (there.is_met) {
            sharp = seen_of_field(probe, way);
        } else if (params.parallax == PARALLAX_DISTANCE) {
            sharp = vec4(light_towards(probe, way), sees_past(probe, way, true));
        } else {
            // Which surface that is, nobody asks: probes count that see this one.
            sharp = vec4(light_towards(probe, way), sees_surface(probe, surface, cage));
        }
        float share = share_of(cage, corner), weight = share * max(sharp.a, 1e-4);
        vec3 light = light_of_lobe(probe, way, at_probe, sharp.rgb);
        sum += vec4(weight * light, share * sharp.a);
        weights += weight;
    }
    return vec4(sum.rgb / weights, sum.a);
}

// The mean over all directions in front of a surface, by the cosine.
vec3 light_of_all_sides(Surface surface) {
    Cage cage = cage_around(surface.position_ws, surface.geometric_normal);
    vec3 sum = vec3(0.0);
    float weights = 0.0;
    for (uint corner = 0u; corner < 8u; ++corner) {
        uint probe = probe_at(cage.first + step_to(corner));
        float weight = share_of(cage, corner) * max(sees_surface(probe, surface, cage), 1e-4);
        sum += weight * light_in_level(probe, ALL_SIDES, surface.shading_normal);
        weights += weight;
    }
    return sum / weights;
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, ivec2(frame.size_px.xy)))) return;
    Surface surface;
    vec4 lobe = texelFetch(sampler2D(specular, nearest_clamp), pixel, 0);
    if (!read_surface(pixel, surface) || lobe.a < 0.0) {
        imageStore(indirect_specular, pixel, vec4(0.0));
        return;
    }
    vec3 to_eye = normalize(frame.eye_ws.xyz - surface.position_ws);
    float cosine = dot(surface.shading_normal, to_eye);
    vec4 light = vec4(0.0);
    if (lobe.a >= FROM_ALL_SIDES) {
        light = vec4(light_of_all_sides(surface), 1.0);
    } else if (lobe.a <= ROUGHEST) {
        vec3 direction = reflect(-to_eye, surface.shading_normal);
        // A bent normal may mirror what is below the surface: that is for rays too.
        if (dot(direction, surface.geometric_normal) > 0.0)
            light = light_of_lobes(surface, direction, lobe.a);
    }
    vec2 reflected = reflected_by_lobe(cosine, lobe.a);
    if (light.a < LEAST_SEEN || cosine <= 0.0) {
        imageStore(indirect_specular, pixel, vec4(vec3(0.0), 1.0));
        return;
    }
    light.rgb *= lobe.rgb * reflected.x + reflected.y;
    imageStore(indirect_specular, pixel, vec4(light.rgb, 0.0));
}
