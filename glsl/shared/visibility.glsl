// Visibility of a light from its shadow maps.
#ifndef LUMIVOX_VISIBILITY
#define LUMIVOX_VISIBILITY

#include "shared/light_view.glsl"

// The including pass declares `light_views` and `shadow_maps` (a depth array, one layer a view).

// Slope of a facet beside a receiver: depth over distance across the light. In cascades, where
// receivers are moved off their surface, the smaller one is enough.
const float FACET_SLOPE = 0.5, CASCADE_FACET_SLOPE = 0.25;

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

// Edges of a texel [m] at a depth.
vec2 texel_edges(LightView view, float depth_m) {
    return vec2(length(view.right.xyz), length(view.down.xyz))
        * (2.0 * (view.origin_kind.w == 0.0 ? 1.0 : depth_m) / float(view.light.y));
}

// How steeply a receiver's plane is followed [texels].
const float PLANE_REACH = 16.0;

// A point that light may fall on, as a light view sees it.
struct Receiver {
    vec3 position;      // [m]
    vec3 normal;
    vec3 map;           // map coordinates [-1, 1]² and view depth [m]
    vec2 texel_m;       // edges of a texel
    float reach_m;      // at most so far from `map.z` the receiver's plane is followed
    float slack_m;      // depth difference that still counts as lit
    float facet_slope;
};

// Depth [m] at which a texel's ray meets the receiver's tangent plane.
float plane_depth(LightView view, vec2 map, Receiver receiver) {
    vec3 across = map.x * view.right.xyz + map.y * view.down.xyz;
    vec3 start = view.origin_kind.w == 0.0 ? view.origin_kind.xyz + across : view.origin_kind.xyz;
    vec3 ray = view.origin_kind.w == 0.0 ? view.forward.xyz : view.forward.xyz + across;
    float along = dot(receiver.normal, ray), depth_m = receiver.map.z;
    return abs(along) < 1e-4 * length(ray)
        ? depth_m
        : clamp(dot(receiver.normal, receiver.position - start) / along,
              depth_m - receiver.reach_m, depth_m + receiver.reach_m);
}

// Rounding of depths in a cascade's map and of positions, as a share of the depth range.
const float DEPTH_ROUNDING = 1e-6;

// A cascade has no bias but what its texels ask for. The receiver is moved off its surface: where
// the light grazes it, as far as the four texels around it reach and the slope of facets lets them
// see, and not at all where the light falls straight on.
Receiver receiver_of(
    LightView view, vec3 position, vec3 normal, float slack_m, bool faceted) {
    bool is_cascade = CASCADES && view.anchor.w != 0.0;
    float facet_slope = is_cascade ? CASCADE_FACET_SLOPE : FACET_SLOPE;
    Receiver receiver = Receiver(position, normal, project(view, position), vec2(0.0), 0.0,
        slack_m, faceted ? facet_slope : 0.0);
    if (!is_cascade) {
        receiver.texel_m = vec2(texel_edges(view, receiver.map.z).x);
        receiver.slack_m += 1e-4 * receiver.map.z;
    } else {
        receiver.texel_m = texel_edges(view, 1.0);
        vec2 across = vec2(dot(normal, normalize(view.right.xyz)),
            dot(normal, normalize(view.down.xyz)));
        receiver.position +=
            normal * ((1.0 + 0.5 * CASCADE_FACET_SLOPE) * dot(abs(across), receiver.texel_m));
        receiver.map = project(view, receiver.position);
        receiver.slack_m += DEPTH_ROUNDING * view.right.w;
    }
    receiver.reach_m = PLANE_REACH * max(receiver.texel_m.x, receiver.texel_m.y);
    return receiver;
}

// Place of a receiver in the map [texels]; whole numbers are middles of texels.
vec2 texel_place(LightView view, Receiver receiver) {
    return (receiver.map.xy * 0.5 + 0.5) * float(view.light.y) - 0.5;
}

// Whether the texel `at` lets light pass to the receiver. It compares with the receiver's tangent
// plane at the texel, so that a lit plane does not shadow itself however coarse the map is. A
// receiver on a surface of facets has a `facet_slope`: beside it, another facet may be nearer to
// the light than its plane and than itself, by that share of the way to the texel, and does not
// shadow it.
bool is_lit(uint index, LightView view, Receiver receiver, vec2 at) {
    float size = float(view.light.y);
    float stored = map_depth(view,
        texelFetch(sampler2DArray(shadow_maps, nearest_clamp), ivec3(at, index), 0).r,
        view.right.w);
    float depth_m = plane_depth(view, (at + 0.5) / size * 2.0 - 1.0, receiver);
    if (receiver.facet_slope > 0.0)
        depth_m = min(depth_m, receiver.map.z)
            - receiver.facet_slope * length((at - texel_place(view, receiver)) * receiver.texel_m);
    return stored >= depth_m - receiver.slack_m;
}

// Share of the light that reaches a receiver by four comparisons, weighted bilinearly.
float bilinear_visibility(uint index, LightView view, Receiver receiver) {
    vec2 last = vec2(float(view.light.y) - 1.0), texel = texel_place(view, receiver);
    vec2 base = floor(texel), f = texel - base;
    float lit = 0.0;
    for (int i = 0; i < 4; ++i) {
        vec2 corner = vec2(i & 1, i >> 1);
        vec2 weight = mix(1.0 - f, f, corner);
        lit += is_lit(index, view, receiver, clamp(base + corner, vec2(0.0), last))
            ? weight.x * weight.y
            : 0.0;
    }
    return lit;
}

#ifdef SHADOW_FILTERS
#include "shared/shadow_filters.glsl"
#else
float filtered_visibility(uint index, LightView view, Receiver receiver) {
    return bilinear_visibility(index, view, receiver);
}
#endif

// Share of the light that reaches a point, as one light view sees it.
float view_visibility(
    uint index, Light light, vec3 position, vec3 normal, float slack_m, bool faceted) {
    LightView view = light_views[index];
    Receiver receiver = receiver_of(view, position, normal, slack_m, faceted);
    if (receiver.map.z <= 0.0 || any(greaterThan(abs(receiver.map.xy), vec2(1.0))))
        return light.position_kind.w == LIGHT_SPOT ? 0.0 : 1.0;
    return filtered_visibility(index, view, receiver);
}

// Room at the border of a cascade for moved receivers and for taps [texels].
const float CASCADE_ROOM = 3.0;
// Part of half a cascade's width over which it passes into the next.
const float CASCADE_BLEND = 0.1;

// Share of a cascade in what is seen at a place of its map: 1 inside, 0 outside; in between near a
// border beyond which there is more of the scene.
float cascade_share(LightView view, vec2 map) {
    vec2 inside = mix(vec2(1.0), 1.0 - abs(map), view.border.xy);
    float room = 2.0 * CASCADE_ROOM / float(view.light.y);
    return clamp((min(inside.x, inside.y) - room) / CASCADE_BLEND, 0.0, 1.0);
}

// The view of a light that shows a point, of those from `views.x` on, `views.y` in number: the
// finest cascade that has it.
uint view_of(Light light, uvec2 views, vec3 position) {
    if (light.position_kind.w == LIGHT_POINT)
        return views.x + cube_face(position - light.position_kind.xyz);
    uint index = views.x;
    if (CASCADES) {
        for (uint last = views.x + views.y - 1u; index < last; ++index) {
            LightView view = light_views[index];
            if (cascade_share(view, project(view, position).xy) > 0.0) break;
        }
    }
    return index;
}

// Fraction of the light that reaches `position` by the views from `views.x` on. `slack_m` is the
// depth difference that still counts as lit.
float visibility_in(
    Light light, uvec2 views, vec3 position, vec3 normal, float slack_m, bool faceted) {
    uint index = view_of(light, views, position);
    bool has_coarser =
        light.position_kind.w == LIGHT_DIRECTIONAL && index + 1u < views.x + views.y;
    float share = 1.0, lit = 0.0;
    for (int turn = int(CASCADES && has_coarser); turn > 0; --turn) {
        LightView view = light_views[index];
        share = cascade_share(view, project(view, position).xy);
    }
    // A loop and not a branch: a software driver takes every branch, but leaves a loop when it may.
    for (uint i = 0u; i < (CASCADES && share < 1.0 ? 2u : 1u); ++i)
        lit += (i == 0u ? share : 1.0 - share)
            * view_visibility(index + i, light, position, normal, slack_m, faceted);
    return lit;
}

// The same by the views for lookups anywhere.
float light_visibility(Light light, vec3 position, vec3 normal, float slack_m, bool faceted) {
    return visibility_in(light, light.views.xy, position, normal, slack_m, faceted);
}

#endif
