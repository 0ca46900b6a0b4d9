#version 460
#extension GL_GOOGLE_include_directive : require
// clipmap.mark_filled: which texels of a level may be other than zero: those of its voxels, and
// those that lie on such texels of the next finer level. A thread a block of 4³ texels.
layout(local_size_x = 4, local_size_y = 4, local_size_z = 4) in;

#include "gi/voxel_cones/clipmap/filled.glsl"

layout(constant_id = 0) const bool HAS_VOXELS = true;   // not a mip above the outermost level
layout(constant_id = 1) const bool KEPT = false;        // what is marked stays so

layout(std430, set = 1, binding = 0) restrict readonly buffer Occupancy { uvec2 occupancy[]; };
layout(set = 1, binding = 1, rgba16ui) uniform restrict uimage3D filled;

layout(push_constant) uniform FilledParams {
    // xyz: first texel of the level, from that of the next finer one [its texels]; w: n
    ivec4 from_finer;
    ivec4 first_block;   // xyz: first block that is made
    ivec4 end_block;     // xyz: end of those that are made
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

void main() {
    int n = params.from_finer.w, level = params.filled_level;
    ivec3 block = params.first_block.xyz + ivec3(gl_GlobalInvocationID),
          blocks = level_size(level, n, params.levels) >> 2;
    if (any(greaterThanEqual(block, params.end_block.xyz))) return;
    uvec2 words = uvec2(0u);
    if (HAS_VOXELS)
        words = words_of_block(occupancy[block.x + blocks.x * (block.y + blocks.y * block.z)]);
    ivec3 finer = (8 * block + params.from_finer.xyz) >> 2,
          last = (level_size(level - 1, n, params.levels) >> 2) - 1;
    // Seven blocks of eight lie beside the finer level: their loop ends at once.
    bool meets = level > 0 && all(greaterThanEqual(finer, ivec3(-1)))
        && all(lessThanEqual(finer, last));
    int parts = meets ? 8 : 0;
    for (int i = 0; i < parts; ++i) {
        ivec3 part = ivec3(i & 1, i >> 1 & 1, i >> 2), at = finer + part;
        uvec2 of_finer = words_of_layers(imageLoad(filled,
            filled_block(clamp(at, ivec3(0), last), level - 1, n, params.levels)));
        uint marks =
            (halved(of_finer.x) | halved(of_finer.y) << 16) << 2 * part.x + 8 * part.y;
        if (at != clamp(at, ivec3(0), last)) marks = 0u;
        words |= part.z == 0 ? uvec2(marks, 0u) : uvec2(0u, marks);
    }
    ivec3 texel = filled_block(block, level, n, params.levels);
    if (KEPT) words |= words_of_layers(imageLoad(filled, texel));
    imageStore(filled, texel, uvec4(words, words >> 16).xzyw & 0xffffu);
}
