// Writing of the clipmap's texels.
#ifndef LUMIVOX_STORE
#define LUMIVOX_STORE

#include "gi/voxel_cones/clipmap/atlas.glsl"

// From a row or layer to its copy beyond the other end; 0 where it has none.
int copy_offset(int at, int n) {
    return at == 0 ? n : at == n - 1 ? -n : 0;
}

// The including pass declares `clipmap` (image3D). `texel` is modulo n.
void store_texel(ivec3 texel, int face, int level, int n, vec4 value) {
    ivec3 at = level_texel(texel, face, level, n);
    imageStore(clipmap, at, value);
    int above = copy_offset(texel.z, n);
    if (above != 0) imageStore(clipmap, at + ivec3(0, 0, above), value);
    if (FACES) {
        int beside = copy_offset(texel.y, n);
        if (beside != 0) imageStore(clipmap, at + ivec3(0, beside, 0), value);
        if (beside != 0 && above != 0) imageStore(clipmap, at + ivec3(0, beside, above), value);
    }
}

#endif
