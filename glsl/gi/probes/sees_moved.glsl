// Whether a texel of a map of distances may see something else than before. The including pass
// declares `params` with `low`, `high`, `reach` and `cell_m`.
#ifndef LUMIVOX_PROBES_SEES_MOVED
#define LUMIVOX_PROBES_SEES_MOVED

#include "gi/probes/moment_rays.glsl"
#include "gi/probes/touches.glsl"

#ifdef RASTER
// As far as views go, and along what is drawn in a ray's place.
bool ray_sees_moved(vec3 place, vec3 direction) {
    return touches_box(place, drawn_along(direction), uintBitsToFloat(0x7f800000u));
}
#else
bool ray_sees_moved(vec3 place, vec3 direction) {
    return touches_box(place, direction, params.reach * params.cell_m);
}
#endif

// `place`: of its probe [m]; w: not 0 where the probe stands elsewhere than it did.
bool sees_moved(vec4 place, ivec2 texel, uint edge) {
    bool is_changed = place.w != 0.0;
    for (uint i = 0u; i < RAYS_OF_TEXEL; ++i)
        is_changed = is_changed || ray_sees_moved(place.xyz, ray_of_texel(texel, i, edge));
    return is_changed;
}

#endif
