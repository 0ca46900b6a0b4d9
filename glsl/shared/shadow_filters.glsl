// Filters of shadow maps for the direct light; the including pass declares SHADOW_FILTER and
// sun_tangent(), the tangent of half the angular diameter of directional lights.
#ifndef LUMIVOX_SHADOW_FILTERS
#define LUMIVOX_SHADOW_FILTERS

const uint FILTER_POINT = 0u, FILTER_PCSS = 2u;

// The widest search for what hides the light, and the widest penumbra: radius [texels].
const float PCSS_REACH = 24.0;
const int SEARCH_TAPS = 16, PENUMBRA_TAPS = 32;

const float GOLDEN_ANGLE = 2.39996323;

// One of `count` places evenly in the unit disc (Vogel 1979).
vec2 disc_place(int i, int count) {
    float angle = GOLDEN_ANGLE * float(i);
    return sqrt((float(i) + 0.5) / float(count)) * vec2(cos(angle), sin(angle));
}

// The texel of a tap; `radius_m` around the receiver.
vec2 tap(LightView view, Receiver receiver, vec2 place, float radius_m) {
    vec2 radius = min(vec2(radius_m) / receiver.texel_m, vec2(PCSS_REACH));
    return clamp(floor(texel_place(view, receiver) + radius * place + 0.5), vec2(0.0),
        vec2(float(view.light.y) - 1.0));
}

// Percentage-closer soft shadows (Fernando 2005): what hides the light within the cone towards it,
// is on the mean so far away; the penumbra is as wide as the light seen from there. A narrower one
// than the comparison of four texels is that.
float pcss_visibility(uint index, LightView view, Receiver receiver) {
    float sum_m = 0.0, count = 0.0;
    for (int i = 0; i < SEARCH_TAPS; ++i) {
        vec2 at = tap(view, receiver, disc_place(i, SEARCH_TAPS), sun_tangent() * receiver.map.z);
        if (is_lit(index, view, receiver, at)) continue;
        float stored =
            texelFetch(sampler2DArray(shadow_maps, nearest_clamp), ivec3(at, index), 0).r;
        sum_m += receiver.map.z - map_depth(view, stored, view.right.w);
        count += 1.0;
    }
    float radius_m = sun_tangent() * max(sum_m, 0.0) / max(count, 1.0);
    if (radius_m <= max(receiver.texel_m.x, receiver.texel_m.y))
        return bilinear_visibility(index, view, receiver);
    float lit = 0.0;
    for (int i = 0; i < PENUMBRA_TAPS; ++i) {
        vec2 at = tap(view, receiver, disc_place(i, PENUMBRA_TAPS), radius_m);
        lit += is_lit(index, view, receiver, at) ? 1.0 : 0.0;
    }
    return lit / float(PENUMBRA_TAPS);
}

float filtered_visibility(uint index, LightView view, Receiver receiver) {
    if (SHADOW_FILTER == FILTER_POINT) {
        vec2 last = vec2(float(view.light.y) - 1.0);
        vec2 at = clamp(floor(texel_place(view, receiver) + 0.5), vec2(0.0), last);
        return is_lit(index, view, receiver, at) ? 1.0 : 0.0;
    }
    if (SHADOW_FILTER == FILTER_PCSS && view.origin_kind.w == 0.0)
        return pcss_visibility(index, view, receiver);
    return bilinear_visibility(index, view, receiver);
}

#endif
