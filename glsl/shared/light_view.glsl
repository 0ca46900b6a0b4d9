// Light views: the shadow map and reflective shadow map of each light, one array layer a view.
#ifndef LUMIVOX_LIGHT_VIEW
#define LUMIVOX_LIGHT_VIEW

#include "shared/frame.glsl"
#include "shared/clear_shadow.glsl"

// Whether a light has cascades. Passes do not declare this constant: the graph sets it from the
// scene of the frame (Rust: graph::SCENE_CONSTANTS).
layout(constant_id = 65) const bool CASCADES = true;

struct LightView {
    mat4 clip_from_world;
    // xyz: light position, or the map's centre on its near plane [m]; w: 0 parallel, 1 perspective
    vec4 origin_kind;
    // xyz: from the map's centre to its right edge: [m], or per unit of view depth
    vec4 right;
    vec4 down;          // xyz: from the map's centre to its lower edge, likewise
    vec4 forward;       // xyz: unit direction of travel; w: depth of the near plane [m]
    // x: index of the light; y: map size [texels]; zw: of a cascade, its first texel
    uvec4 light;
    // of a cascade, xyz: where texels are counted from, on the near plane [m]; w: 1 + its number,
    // 0 the finest; else 0
    vec4 anchor;
    vec4 border;        // xy: of a cascade, 1 where the scene goes on beyond its edge
};

const float LIGHT_DIRECTIONAL = 0.0;
const float LIGHT_POINT = 1.0;
const float LIGHT_SPOT = 2.0;

// View depth [m] from the depth buffer: parallel views are linear, perspective ones reversed with
// an infinite far plane (1 at the near plane, 0 far).
float map_depth(LightView view, float stored, float depth_range_m) {
    return view.origin_kind.w == 0.0 ? (1.0 - stored) * depth_range_m
                                     : view.forward.w / max(stored, 1e-30);
}

// Fraction of the light's intensity that leaves in direction `wi_from_light` (unit): the spot's
// cone, falling linearly in angle.
float light_falloff(Light light, vec3 direction) {
    if (light.position_kind.w != LIGHT_SPOT) return 1.0;
    float angle = acos(clamp(dot(direction, light.direction_inner.xyz), -1.0, 1.0));
    float inner = light.direction_inner.w, outer = light.power_outer.w;
    return angle <= inner ? 1.0 : clamp((outer - angle) / max(outer - inner, 1e-6), 0.0, 1.0);
}

// Unit direction towards the light and the irradiance on a plane that faces it, where nothing but
// what is clear is in the way [W/m²].
vec3 light_irradiance(Light light, vec3 position, out vec3 to_light) {
    if (light.position_kind.w == LIGHT_DIRECTIONAL) {
        to_light = -light.direction_inner.xyz;
        return light.power_outer.rgb * clear_share(light, position);
    }
    vec3 offset = light.position_kind.xyz - position;
    float squared = max(dot(offset, offset), 1e-12);
    to_light = offset * inversesqrt(squared);
    return light.power_outer.rgb * (light_falloff(light, -to_light) / squared)
        * clear_share(light, position);
}

#endif
