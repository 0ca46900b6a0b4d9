#version 460
#extension GL_GOOGLE_include_directive : require
// voxel.inject_rsm where voxels are found through the occupancy of a grid.
#include "gi/shared/voxel/light/inject.glsl"

layout(std430, set = 1, binding = 8) restrict readonly buffer Occupancy { uvec2 occupancy[]; };
layout(std430, set = 1, binding = 9) restrict readonly buffer BlockBases { uint block_bases[]; };

int voxel_at(vec3 position) {
    ivec3 own = ivec3(floor(position)) - params.piece.xyz;
    if (any(lessThan(own, ivec3(0))) || any(greaterThanEqual(own, ivec3(params.piece.w))))
        return -1;
    uint block = block_index(uvec3(own), uint(params.piece.w)), bit = block_bit(uvec3(own));
    uvec2 words = occupancy[block];
    return block_has(words, bit) ? int(block_bases[block] + set_bits_below(words, bit)) : -1;
}
