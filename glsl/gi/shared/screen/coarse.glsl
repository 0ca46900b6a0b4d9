// A pixel's four neighbours among those that gather, one in each square. The including pass
// declares `view_depth` and `normals` of all pixels, and `CoarseParams params`.
#ifndef LUMIVOX_COARSE
#define LUMIVOX_COARSE

#include "gi/shared/screen/one_surface.glsl"

// Less than this of a bilinear sample is none.
const float LEAST_SHOWN = 1e-3;

// Weights of the texels from `corner` on, left to right and down, which show the pixel's own
// surface; they are shares of a bilinear sample.
vec4 coarse_weights(ivec2 pixel, Surface surface, out ivec2 corner) {
    int scale = int(params.scale);
    vec2 place = vec2(pixel - scale / 2) / float(scale);
    corner = ivec2(floor(place));
    vec2 share = place - vec2(corner);
    Own own = own_surface(surface, params.plane_tolerance, params.normal_cosine);
    vec4 weights = vec4(0.0);
    for (int i = 0; i < 4; ++i) {
        ivec2 step = ivec2(i & 1, i >> 1), at = corner + step, seen = at * scale + scale / 2;
        vec2 near = mix(1.0 - share, share, vec2(step));
        if (near.x * near.y > 0.0 && all(greaterThanEqual(at, ivec2(0)))
            && all(lessThan(at, ivec2(params.size)))
            && all(lessThan(seen, ivec2(frame.size_px.xy))) && shares_surface(own, seen))
            weights[i] = near.x * near.y;
    }
    return weights;
}

#endif
