// Voxels as a cache of the light at a path's last place. The including pass defines CACHE_BINDING,
// the first binding of what is read here.
#ifndef LUMIVOX_RAY_TRACED_CACHE
#define LUMIVOX_RAY_TRACED_CACHE

#include "gi/shared/voxel/records.glsl"

const uint SIDES = 6u;   // radiances of a voxel: each face has its own

layout(std430, set = 1, binding = CACHE_BINDING) restrict readonly buffer Occupancy {
    uvec2 occupancy[];
};
layout(std430, set = 1, binding = CACHE_BINDING + 1) restrict readonly buffer BlockBases {
    uint block_bases[];
};
layout(std430, set = 1, binding = CACHE_BINDING + 2) restrict readonly buffer VoxelRecords {
    Voxel voxel_records[];
};
layout(std430, set = 1, binding = CACHE_BINDING + 3) restrict readonly buffer VoxelRadiance {
    uvec2 voxel_radiance[];
};

#include "gi/shared/voxel/trace/dense.glsl"
#include "gi/shared/voxel/trace/radiance.glsl"
#include "gi/shared/voxel/trace/hit.glsl"

Voxel surface_of(uint slot) {
    return voxel_records[slot];
}

// What a place reflects to its viewer of the lights.
vec3 cached_light(PathVertex v) {
    return radiance_at((v.position - params.grid.xyz) / params.grid.w, v.geometric_normal);
}

#endif
