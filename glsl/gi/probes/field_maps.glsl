// What the maps of a light field show. The including pass declares FIELD_BINDING, FIELD_CONSTANT,
// and `params` with a LookupRow `lookup`.
#ifndef LUMIVOX_PROBES_FIELD_MAPS
#define LUMIVOX_PROBES_FIELD_MAPS

#include "gi/probes/field_texels.glsl"

layout(constant_id = FIELD_CONSTANT) const uint FIELD_TEXELS = 64;   // edge of a map

layout(set = 1, binding = FIELD_BINDING) uniform utexture2D field_surfaces;
layout(set = 1, binding = FIELD_BINDING + 1) uniform utexture2D field_radiance;

// Of how many of its own edges a texel's surface may be off.
const float TEXEL_SLACK = 0.75;

// Edge of a texel at distance 1: the sphere is 4π sr.
float texel_size() {
    return 4.0 / float(FIELD_TEXELS);
}

FieldTexel surface_at(ivec2 map, ivec2 texel) {
    return unpack_field_texel(
        texelFetch(usampler2D(field_surfaces, nearest_clamp), map + texel, 0).r);
}

// Four texels around a direction, and their shares.
struct FieldCorners {
    ivec2 map;
    ivec2 low;
    vec2 between;
};

FieldCorners corners_around(uint probe, vec3 direction) {
    vec2 at = (octahedral_from_unit(direction) * 0.5 + 0.5) * float(FIELD_TEXELS) - 0.5;
    vec2 low = floor(at);
    return FieldCorners(
        field_map(probe, params.lookup.columns, FIELD_TEXELS), ivec2(low), at - low);
}

ivec2 corner_texel(FieldCorners corners, int corner, out float share) {
    ivec2 step = ivec2(corner & 1, corner >> 1);
    vec2 shares = mix(1.0 - corners.between, corners.between, vec2(step));
    share = shares.x * shares.y;
    return texel_beyond(corners.low + step, int(FIELD_TEXELS));
}

// How far a place in the frame of a probe is in front of the surface that a texel sees [cells], and
// how far off it may be and lie on it.
vec2 above_texel(FieldTexel seen, ivec2 texel, vec3 place) {
    vec3 to_texel = direction_of_texel(vec2(texel), FIELD_TEXELS);
    return vec2(dot(seen.normal, place - seen.distance * to_texel),
        TEXEL_SLACK * texel_size() * seen.distance);
}

// Radiance [W/(m² sr)] of what a probe sees at a place in its frame [cells], between the four
// texels around it, as far as they show the same surface; in alpha how far they do. 0: it is that
// of the nearest texel.
vec4 seen_of_field(uint probe, vec3 place) {
    FieldCorners corners = corners_around(probe, normalize(place));
    vec3 sum = vec3(0.0), nearest = vec3(0.0);
    float shares = 0.0, most = -1.0;
    for (int corner = 0; corner < 4; ++corner) {
        float share;
        ivec2 texel = corner_texel(corners, corner, share);
        FieldTexel seen = surface_at(corners.map, texel);
        uint packed =
            texelFetch(usampler2D(field_radiance, nearest_clamp), corners.map + texel, 0).r;
        vec3 light = unpack_rgbe(packed);
        if (share > most) {
            most = share;
            nearest = light;
        }
        if (isinf(seen.distance)) continue;
        vec2 above = above_texel(seen, texel, place);
        if (abs(above.x) > above.y) continue;
        sum += share * light;
        shares += share;
    }
    return shares > 0.0 ? vec4(sum / shares, shares) : vec4(nearest, 0.0);
}

#endif
