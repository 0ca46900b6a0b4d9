// Which way the light of a voxel leaves it. The including file knows Voxel
// (gi/shared/voxel/records.glsl).
#ifndef LUMIVOX_LIT_NORMALS
#define LUMIVOX_LIT_NORMALS

#include "shared/luminance.glsl"

// Mean normal of what shines of a voxel whose sides have these radiances, times its luminance.
vec3 lit_normal(Voxel voxel, vec3 front, vec3 back) {
    vec3 normal = is_opposed(voxel) ? front_of(voxel) : unpack_mean_normal(voxel.normal);
    return luminance_of(front - back) * normal;
}

#endif
