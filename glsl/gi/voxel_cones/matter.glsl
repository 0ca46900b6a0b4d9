// Where trilinear samples of dense texels can be other than zero. Stencil i of a level are the
// texels i and i + 1 along each axis, which all samples between the centres of these texels read;
// its bit is 1 where one of them may be other than zero. A word has the bits of 4×4×2 stencils, x +
// 4 y + 16 z. Mips lie one behind the other along z in one image without mips: a fetch at a level
// of its own in each lane is dear.
#ifndef LUMIVOX_MATTER
#define LUMIVOX_MATTER

// `size`: texels along an edge of mip 0.
ivec3 matter_texel(ivec3 stencil, int size, int mip) {
    return ivec3(stencil.xy >> 2, (stencil.z >> 1) + size - (size >> mip));
}

int stencil_bit(ivec3 stencil) {
    return stencil.x & 3 | (stencil.y & 3) << 2 | (stencil.z & 1) << 4;
}

// From bits of the texels of a block to those of its stencils, along one axis; `next`: the block
// behind it.
uvec2 spread_along_x(uvec2 own, uvec2 next) {
    return own | own >> 1 & 0x77777777u | next << 3 & 0x88888888u;
}

uvec2 spread_along_y(uvec2 own, uvec2 next) {
    return own | own >> 4 & 0x0fff0fffu | next << 12 & 0xf000f000u;
}

uvec2 spread_along_z(uvec2 own, uvec2 next) {
    return own | own >> 16 | uvec2(own.y, next.x) << 16;
}

// Swaps the bits that `mask` names with those `distance` higher.
uvec2 swap_bits(uvec2 words, uint mask, uint distance) {
    uvec2 differing = (words >> distance ^ words) & mask;
    return words ^ differing ^ differing << distance;
}

// The two words of a block of 4³ texels, low z first, from its Morton order
// (gi/shared/voxel/grid.glsl).
uvec2 words_of_block(uvec2 block) {
    return swap_bits(
        swap_bits(swap_bits(block, 0x00cc00ccu, 6u), 0x00f000f0u, 4u), 0x0000ff00u, 8u);
}

#endif
