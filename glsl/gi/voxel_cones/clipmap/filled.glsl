// Where the words of a level of the clipmap are, of its texels and of its stencils
// (gi/voxel_cones/matter.glsl). The levels lie one behind the other along z, and behind them the
// mips above the outermost one. Texels are counted from the level's smallest corner.
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

#endif
