// Writing of the clipmap's texels.
#ifndef LUMIVOX_STORE
#define LUMIVOX_STORE

#include "gi/clipmap/atlas.glsl"

// The including pass declares `clipmap` (image3D). `texel` is modulo n.
void store_texel(ivec3 texel, int level, int n, vec4 value) {
    int layer = slab_layer(level, n);
    imageStore(clipmap, ivec3(texel.xy, layer + texel.z), value);
    for (int turn = int(texel.z == 0); turn > 0; --turn) imageStore(clipmap, ivec3(texel.xy, layer + n), value);
    for (int turn = int(texel.z == n - 1); turn > 0; --turn) imageStore(clipmap, ivec3(texel.xy, layer - 1), value);
}

#endif
