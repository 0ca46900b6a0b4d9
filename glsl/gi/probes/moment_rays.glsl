// The rays over which a texel of a map of distances is averaged.
#ifndef LUMIVOX_PROBES_MOMENT_RAYS
#define LUMIVOX_PROBES_MOMENT_RAYS

#include "gi/probes/atlas.glsl"

// Along each axis of a texel, and in all.
const uint RAYS_ALONG = 2u, RAYS_OF_TEXEL = RAYS_ALONG * RAYS_ALONG;

vec3 ray_of_texel(ivec2 texel, uint ray, uint edge) {
    vec2 within =
        (vec2(ray % RAYS_ALONG, ray / RAYS_ALONG) + 0.5) / float(RAYS_ALONG) - 0.5;
    return direction_of_texel(vec2(texel) + within, edge);
}

#endif
