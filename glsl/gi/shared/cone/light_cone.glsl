// What a cone to a light sees of it. The including pass has `grid` in its parameters, as the
// gathers do.
#ifndef LUMIVOX_LIGHT_CONE
#define LUMIVOX_LIGHT_CONE

#include "shared/light_view.glsl"
#include "gi/shared/cone/march.glsl"

// Where the last sample of a cone may begin so that, with its half diameter of at least `least` /
// 2, it stays in front of what is `distance` away [voxels].
float shadow_end(float distance, float tan_half, float step_factor, float least) {
    float wide = distance * max(1.0 - step_factor * tan_half, 0.25) / (1.0 + tan_half);
    return min(wide, distance - 0.5 * least - 0.5 * step_factor * least);
}

// `origin` [voxels] is `height` above the plane of `normal`; `direction` is a unit vector.
float cone_visibility(vec3 origin, vec3 normal, float height, vec3 direction, float distance,
    float tan_half, MarchSettings m) {
    // No way through the grid is longer than its diagonal.
    float longest = 1.8 * m.resolution,
          least = least_diameter(origin + min(distance, longest) * direction);
    m.max_distance = min(shadow_end(distance, tan_half, m.step_factor, least), longest);
    m.ao_falloff = 0.0;
    return march_cone(origin, direction, tan_half, height, max(dot(direction, normal), 0.0), m)
        .visibility;
}

// Of a light in the direction `to_light`, which is exact where it is infinitely far.
float light_visibility(Light light, vec3 origin, vec3 normal, float height, vec3 to_light,
    float tan_half, MarchSettings m) {
    float distance = 1e9;
    if (light.position_kind.w != LIGHT_DIRECTIONAL) {
        vec3 offset = (light.position_kind.xyz - params.grid.xyz) / params.grid.w - origin;
        distance = length(offset);
        to_light = offset / max(distance, 1e-6);
    }
    return cone_visibility(origin, normal, height, to_light, distance, tan_half, m);
}

#endif
