// Voxels as a cache of the light at a path's last place.
#ifndef LUMIVOX_PATHS_CACHE
#define LUMIVOX_PATHS_CACHE

#define SPACE_CONSTANT 6
#include "gi/shared/voxel/trace/lit_grid.glsl"
#include "gi/shared/voxel/trace/hit.glsl"

// What a place reflects to its viewer of the lights.
vec3 cached_light(PathVertex v) {
    return radiance_at((v.position - params.grid.xyz) / params.grid.w, v.geometric_normal);
}

#endif
