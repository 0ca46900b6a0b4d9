// Shadows of what is clear: which share of a light passes it.
#ifndef LUMIVOX_CLEAR_SHADOW
#define LUMIVOX_CLEAR_SHADOW

#include "shared/frame.glsl"
#include "shared/directions.glsl"
#include "shared/packing.glsl"

// Whether lights have such shadows. Passes do not declare this constant: the graph sets it from the
// scene of the frame (Rust: graph::SCENE_CONSTANTS).
layout(constant_id = 68) const bool CLEAR_SHADOWS = true;

// Of each light that has one, a row that says where its map is: of a directional light, xyz: its
// middle [m], w: half its edge [m]. Then a row a texel. rgb: share of light behind all that is
// clear there; w: where the first of that is [m], from the light or, of a directional one, beyond
// the plane through the middle.
layout(std430, set = 0, binding = 12) readonly buffer ClearShadows { vec4 clear_shadows[]; };

// Where a place is in a light's map, of [-1, 1]² where that covers it, and how far it is [m].
vec3 place_in_clear_shadow(Light light, vec3 position) {
    if (light.position_kind.w == 0.0) {
        vec4 middle = clear_shadows[light.clear.x];
        vec3 local = (position - middle.xyz) * frame_around(light.direction_inner.xyz);
        return vec3(local.xy / middle.w, local.z);
    }
    vec3 offset = position - light.position_kind.xyz;
    float distance = max(length(offset), 1e-6);
    return vec3(octahedral_from_unit(offset / distance), distance);
}

// Share of light that passes a texel's surfaces to a distance behind the first of them.
vec3 clear_share_at(Light light, ivec2 texel, float distance) {
    ivec2 at = clamp(texel, ivec2(0), ivec2(light.clear.y - 1u));
    vec4 row = clear_shadows[light.clear.x + 1u + uint(at.y) * light.clear.y + uint(at.x)];
    return distance > row.w ? row.rgb : vec3(1.0);
}

vec3 share_in_clear_shadow(Light light, vec3 position) {
    if (light.clear.y == 0u) return vec3(1.0);
    vec3 place = place_in_clear_shadow(light, position);
    if (any(greaterThan(abs(place.xy), vec2(1.0)))) return vec3(1.0);
    vec2 at = (place.xy * 0.5 + 0.5) * float(light.clear.y) - 0.5;
    ivec2 low = ivec2(floor(at));
    vec2 share = at - floor(at);
    vec3 above = mix(clear_share_at(light, low, place.z),
        clear_share_at(light, low + ivec2(1, 0), place.z), share.x);
    vec3 below = mix(clear_share_at(light, low + ivec2(0, 1), place.z),
        clear_share_at(light, low + ivec2(1, 1), place.z), share.x);
    return mix(above, below, share.y);
}

// Share of a light that reaches a place through all that is clear, where nothing else is in the
// way.
vec3 clear_share(Light light, vec3 position) {
    if (CLEAR_SHADOWS) return share_in_clear_shadow(light, position);
    return vec3(1.0);
}

#endif
