// Where the marks of a level of the clipmap are: words of its stencils
// (gi/voxel_cones/matter.glsl), and blocks of 4³ of its texels. A block is a texel with a component
// of 16 bits for each layer. The levels lie one behind the other along z, and behind them the mips
// above the outermost one. Texels are counted from the level's smallest corner.
#ifndef LUMIVOX_FILLED
#define LUMIVOX_FILLED

#include "gi/voxel_cones/matter.glsl"

// Texels along an edge.
ivec3 level_size(int level, int n, int levels) {
    return ivec3(n >> max(level - levels + 1, 0));
}

ivec3 filled_texel(ivec3 word, int level, int n, int levels) {
    int mip = max(level - levels + 1, 0);
    return word + matter_texel(ivec3(0, 0, min(level, levels - 1) * n), n, mip);
}

ivec3 filled_block(ivec3 block, int level, int n, int levels) {
    ivec3 word = filled_texel(ivec3(block.xy, 2 * block.z), level, n, levels);
    return ivec3(word.xy, word.z >> 1);
}

// The two words of a block from its layers.
uvec2 words_of_layers(uvec4 layers) {
    return layers.xz | layers.yw << 16;
}

#endif
