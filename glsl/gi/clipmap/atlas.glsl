// Where the texels of the clipmap's levels are.
//
// All levels, n³ texels each, are slabs of one 3D texture, one upon the other along z. The texel of voxel v of a level's unbounded grid is at v mod n in its
// slab, so that a level moves without its texels being moved. Along x and y the sampler repeats; along z each slab has a copy of its last layer before it
// and one of its first behind it, so that hardware filtering is right across the wrap.
#ifndef LUMIVOX_ATLAS
#define LUMIVOX_ATLAS

// Layer of the texture that holds layer 0 of a level's slab.
int slab_layer(int level, int n) {
    return level * (n + 2) + 1;
}

#endif
