// Visibility of a light from its shadow maps.
#ifndef LUMIVOX_VISIBILITY
#define LUMIVOX_VISIBILITY

#include "shared/light_view.glsl"

// The including pass declares `light_views` and `shadow_maps` (a depth array, one layer a view).

// Light views of a point light (Rust: POINT_VIEWS of render); no other kind has as many.
const uint POINT_VIEWS = 6u;

// Slope of a facet beside a receiver: depth over distance across the light.
const float FACET_SLOPE = 0.5;

// The view of a point light that looks along the axis nearest to `direction`: +x, −x, +y, −y, +z,
// −z.
uint cube_face(vec3 direction) {
    vec3 m = abs(direction);
    return m.x >= m.y && m.x >= m.z ? (direction.x > 0.0 ? 0u : 1u)
        : m.y >= m.z                ? (direction.y > 0.0 ? 2u : 3u)
                                    : (direction.z > 0.0 ? 4u : 5u);
}

// Map coordinates [-1, 1]² of a point, and its view depth [m].
vec3 project(LightView view, vec3 position) {
    vec3 offset = position - view.origin_kind.xyz;
    float depth = dot(offset, view.forward.xyz);
    float scale = view.origin_kind.w == 0.0 ? 1.0 : 1.0 / max(depth, 1e-20);
    return vec3(dot(offset, view.right.xyz) / dot(view.right.xyz, view.right.xyz) * scale,
        dot(offset, view.down.xyz) / dot(view.down.xyz, view.down.xyz) * scale, depth);
}

// Depth [m] at which a texel's ray meets the receiver's tangent plane.
float plane_depth(LightView view, vec2 map, vec3 position, vec3 normal, float otherwise) {
    vec3 across = map.x * view.right.xyz + map.y * view.down.xyz;
    vec3 start = view.origin_kind.w == 0.0 ? view.origin_kind.xyz + across : view.origin_kind.xyz;
    vec3 ray = view.origin_kind.w == 0.0 ? view.forward.xyz : view.forward.xyz + across;
    float along = dot(normal, ray);
    float limit = 2.0 * length(view.right.xyz) * (view.origin_kind.w == 0.0 ? 1.0 : otherwise)
        / float(view.light.y) * 16.0;
    return abs(along) < 1e-4 * length(ray)
        ? otherwise
        : clamp(dot(normal, position - start) / along, otherwise - limit, otherwise + limit);
}

// Fraction of the light that reaches `position`: four depth comparisons, weighted bilinearly. Each
// compares with the receiver's tangent plane at its own texel, so that a lit plane does not shadow
// itself however coarse the map is. `slack_m` is the depth difference that still counts as lit. A
// receiver on a surface of facets is `faceted`: beside it, another facet may be nearer to the light
// than its plane and than itself, by `FACET_SLOPE` of the way to the texel, and does not shadow it.
float light_visibility(Light light, vec3 position, vec3 normal, float slack_m, bool faceted) {
    uint index = light.views.x;
    if (light.views.y == POINT_VIEWS) index += cube_face(position - light.position_kind.xyz);
    LightView view = light_views[index];
    vec3 map = project(view, position);
    if (map.z <= 0.0 || any(greaterThan(abs(map.xy), vec2(1.0))))
        return light.views.y == POINT_VIEWS || view.origin_kind.w == 0.0 ? 1.0 : 0.0;
    float size = float(view.light.y);
    vec2 texel = (map.xy * 0.5 + 0.5) * size - 0.5;
    vec2 base = floor(texel), f = texel - base;
    float texel_m
        = 2.0 * length(view.right.xyz) * (view.origin_kind.w == 0.0 ? 1.0 : map.z) / size;
    float lit = 0.0;
    for (int i = 0; i < 4; ++i) {
        vec2 corner = vec2(i & 1, i >> 1);
        vec2 at = clamp(base + corner, vec2(0.0), vec2(size - 1.0));
        float stored = map_depth(view,
            texelFetch(sampler2DArray(shadow_maps, nearest_clamp), ivec3(at, index), 0).r,
            view.right.w);
        float receiver = plane_depth(view, (at + 0.5) / size * 2.0 - 1.0, position, normal, map.z);
        if (faceted)
            receiver = min(receiver, map.z) - FACET_SLOPE * texel_m * length(at - texel);
        vec2 weight = mix(1.0 - f, f, corner);
        lit += stored >= receiver - slack_m - 1e-4 * map.z ? weight.x * weight.y : 0.0;
    }
    return lit;
}

#endif
