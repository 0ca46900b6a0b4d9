// Where the texels of the clipmap's levels are.
//
// All levels, n³ texels each, are slabs of one 3D texture, one upon the other along z. The texel of
// voxel v of a level's unbounded grid is at v mod n in its slab, so that a level moves without its
// texels being moved. Along x and y the sampler repeats; along z each slab has a copy of its last
// layer before it and one of its first behind it, so that hardware filtering is right across the
// wrap. Where texels have six faces, a slab is six cubes side by side along y, with such copies
// there too.
#ifndef LUMIVOX_ATLAS
#define LUMIVOX_ATLAS

// The including file declares FACES (bool constant): whether there are six.

// Layer of the texture that holds layer 0 of a level's slab.
int slab_layer(int level, int n) {
    return level * (n + 2) + 1;
}

// Row of the texture that holds row 0 of a face.
int face_row(int face, int n) {
    return FACES ? face * (n + 2) + 1 : 0;
}

// Where a texel (modulo n) of a level is.
ivec3 level_texel(ivec3 texel, int face, int level, int n) {
    return texel + ivec3(0, face_row(face, n), slab_layer(level, n));
}

#endif
