#version 460
#extension GL_GOOGLE_include_directive : require
// clipmap.spread_filled: the stencils of a level that hold a texel that may be other than zero
// (gi/voxel_cones/matter.glsl). A thread a block of 4³.
layout(local_size_x = 4, local_size_y = 4, local_size_z = 4) in;

#include "gi/voxel_cones/clipmap/filled.glsl"

layout(set = 1, binding = 0, rgba16ui) uniform restrict readonly uimage3D filled;
layout(set = 1, binding = 1, r32ui) uniform restrict writeonly uimage3D matter;

layout(push_constant) uniform SpreadParams {
    ivec4 first_block;   // xyz: first block that is made
    ivec4 end_block;     // xyz: end of those that are made
    int spread_level;
    int n;
    int levels;
} params;

uvec2 block_at(ivec3 block) {
    int level = params.spread_level;
    ivec3 blocks = level_size(level, params.n, params.levels) >> 2;
    if (any(greaterThanEqual(block, blocks))) return uvec2(0u);
    return words_of_layers(
        imageLoad(filled, filled_block(block, level, params.n, params.levels)));
}

uvec2 spread_x(ivec3 block) {
    return spread_along_x(block_at(block), block_at(block + ivec3(1, 0, 0)));
}

uvec2 spread_xy(ivec3 block) {
    return spread_along_y(spread_x(block), spread_x(block + ivec3(0, 1, 0)));
}

void main() {
    ivec3 block = params.first_block.xyz + ivec3(gl_GlobalInvocationID);
    int level = params.spread_level;
    if (any(greaterThanEqual(block, params.end_block.xyz))) return;
    uvec2 stencils = spread_along_z(spread_xy(block), spread_xy(block + ivec3(0, 0, 1)));
    ivec3 texel = filled_texel(ivec3(block.xy, 2 * block.z), level, params.n, params.levels);
    imageStore(matter, texel, uvec4(stencils.x));
    imageStore(matter, texel + ivec3(0, 0, 1), uvec4(stencils.y));
}
