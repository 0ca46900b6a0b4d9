// The matter pyramid: whether a trilinear sample of a dense volume with mips can be other than
// zero. Stencil i of mip k are the texels i and i + 1 along each axis, which all samples between
// the centres of these texels read; its bit is 1 where one of them holds an occupied voxel. A word
// has the bits of 4×4×2 stencils, x + 4 y + 16 z. Mips lie one behind the other along z in one
// image without mips: a fetch at a level of its own in each lane is dear.
#ifndef LUMIVOX_MATTER
#define LUMIVOX_MATTER

// `size`: voxels along an edge of the grid.
ivec3 matter_texel(ivec3 stencil, int size, int mip) {
    return ivec3(stencil.xy >> 2, (stencil.z >> 1) + size - (size >> mip));
}

int stencil_bit(ivec3 stencil) {
    return stencil.x & 3 | (stencil.y & 3) << 2 | (stencil.z & 1) << 4;
}

#endif
