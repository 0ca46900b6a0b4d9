// Reflective shadow maps of a directional light's cascades as one: each surface is in one map. The
// including pass declares `light_views`.
#ifndef LUMIVOX_CASCADE
#define LUMIVOX_CASCADE

#include "shared/light_view.glsl"

// Whether a texel of a view is in the finer cascade before it, which is then the one that counts.
// The finer map's edges lie between texels.
bool is_in_finer_cascade(int index, LightView view, ivec2 texel) {
    bool is_in_finer = false;
    // One turn or none of a loop, and not a branch: a software driver takes every branch.
    for (int turn = int(CASCADES && view.anchor.w > 1.0); turn > 0; --turn) {
        LightView finer = light_views[index - 1];
        vec2 ratio = vec2(length(view.right.xyz) / length(finer.right.xyz),
            length(view.down.xyz) / length(finer.down.xyz));
        vec2 place = (vec2(view.light.zw) + vec2(texel) + 0.5) * ratio - vec2(finer.light.zw);
        is_in_finer =
            all(greaterThan(place, vec2(0.0))) && all(lessThan(place, vec2(finer.light.y)));
    }
    return is_in_finer;
}

#endif
