#version 460
#extension GL_GOOGLE_include_directive : require
// clipmap.mark_filled: which texels of a level may be other than zero: those of its voxels, and
// those that lie on such texels of the next finer level. A thread a block of 4³ texels.
layout(local_size_x = 4, local_size_y = 4, local_size_z = 4) in;

#include "gi/voxel_cones/clipmap/filled.glsl"

layout(constant_id = 0) const bool HAS_VOXELS = true;   // not a mip above the outermost level
layout(constant_id = 1) const bool KEPT = false;        // what is marked stays so

layout(std430, set = 1, binding = 0) restrict readonly buffer Occupancy { uvec2 occupancy[]; };
layout(set = 1, binding = 1, r32ui) uniform restrict uimage3D filled;

layout(push_constant) uniform FilledParams {
    // xyz: first texel of the level, from that of the next finer one [its texels]; w: n
    ivec4 from_finer;
    int filled_level;    // that is made, mips above the outermost level behind it
    int levels;
} params;

// Of the 4×4×2 texels of a word, the 2×2 of the next level that lie there.
uint halved(uint word) {
    word |= word >> 16;
    word |= word >> 1;
    word |= word >> 4;
    return word & 1u | word >> 1 & 2u | word >> 4 & 16u | word >> 5 & 32u;
}

// The same of a word of the next finer level, 0 where it has none.
uint halved_finer(ivec3 word, int n) {
    int finer = params.filled_level - 1;
    ivec3 words = level_size(finer, n, params.levels) >> ivec3(2, 2, 1);
    if (any(lessThan(word, ivec3(0))) || any(greaterThanEqual(word, words))) return 0u;
    return halved(imageLoad(filled, filled_texel(word, finer, n, params.levels)).r);
}

void main() {
    int n = params.from_finer.w, level = params.filled_level;
    ivec3 block = ivec3(gl_GlobalInvocationID), blocks = level_size(level, n, params.levels) >> 2;
    if (any(greaterThanEqual(block, blocks))) return;
    uvec2 words = uvec2(0u);
    if (HAS_VOXELS)
        words = words_of_block(occupancy[block.x + blocks.x * (block.y + blocks.y * block.z)]);
    ivec3 finer = (8 * block + params.from_finer.xyz) >> ivec3(2, 2, 1);
    for (int i = 0; i < 16; ++i) {
        ivec3 part = ivec3(i & 1, i >> 1 & 1, i >> 2);
        if (level > 0)
            words[part.z >> 1] |= halved_finer(finer + part, n)
                << 2 * part.x + 8 * part.y + 16 * (part.z & 1);
    }
    for (int i = 0; i < 2; ++i) {
        ivec3 texel =
            filled_texel(ivec3(block.xy, 2 * block.z + i), level, n, params.levels);
        uint kept = 0u;
        if (KEPT) kept = imageLoad(filled, texel).r;
        imageStore(filled, texel, uvec4(kept | words[i]));
    }
}
