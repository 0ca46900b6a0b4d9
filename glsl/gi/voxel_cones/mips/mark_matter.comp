#version 460
#extension GL_GOOGLE_include_directive : require
// voxel_mips.mark_matter: mip 0 of the matter pyramid (gi/voxel_cones/matter.glsl), from the
// occupancy of the voxels. A thread makes the stencils of a block.
layout(local_size_x = 64) in;

#include "gi/voxel_cones/matter.glsl"

layout(std430, set = 1, binding = 0) restrict readonly buffer Occupancy { uvec2 occupancy[]; };
layout(set = 1, binding = 1, r32ui) uniform restrict writeonly uimage3D matter;

uvec2 block_at(uvec3 block, uint blocks) {
    return any(greaterThanEqual(block, uvec3(blocks)))
        ? uvec2(0u)
        : words_of_block(occupancy[block.x + blocks * (block.y + blocks * block.z)]);
}

uvec2 spread_x(uvec3 block, uint blocks) {
    return spread_along_x(block_at(block, blocks), block_at(block + uvec3(1, 0, 0), blocks));
}

uvec2 spread_xy(uvec3 block, uint blocks) {
    return spread_along_y(spread_x(block, blocks), spread_x(block + uvec3(0, 1, 0), blocks));
}

void main() {
    uint blocks = uint(imageSize(matter).x);
    uint index = gl_GlobalInvocationID.x;
    if (index >= blocks * blocks * blocks) return;
    uvec3 block = uvec3(index % blocks, index / blocks % blocks, index / (blocks * blocks));
    uvec2 stencils =
        spread_along_z(spread_xy(block, blocks), spread_xy(block + uvec3(0, 0, 1), blocks));
    ivec3 texel = ivec3(block.xy, 2u * block.z);
    imageStore(matter, texel, uvec4(stencils.x));
    imageStore(matter, texel + ivec3(0, 0, 1), uvec4(stencils.y));
}
