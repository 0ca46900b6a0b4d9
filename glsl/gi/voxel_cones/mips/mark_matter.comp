#version 460
// voxel_mips.mark_matter: mip 0 of the matter pyramid (gi/voxel_cones/mips/matter.glsl), from the
// occupancy of the voxels. A thread makes the stencils of a block.
layout(local_size_x = 64) in;

layout(std430, set = 1, binding = 0) restrict readonly buffer Occupancy { uvec2 occupancy[]; };
layout(set = 1, binding = 1, r32ui) uniform restrict writeonly uimage3D matter;

// Swaps the bits that `mask` names with those `distance` higher.
uvec2 swap_bits(uvec2 words, uint mask, uint distance) {
    uvec2 differing = (words >> distance ^ words) & mask;
    return words ^ differing ^ differing << distance;
}

// From the Morton order of a block (gi/shared/voxel/grid.glsl) to rows along x, then y, then z.
uvec2 rows(uvec2 words) {
    return swap_bits(
        swap_bits(swap_bits(words, 0x00cc00ccu, 6u), 0x00f000f0u, 4u), 0x0000ff00u, 8u);
}

uvec2 block_at(uvec3 block, uint blocks) {
    return any(greaterThanEqual(block, uvec3(blocks)))
        ? uvec2(0u)
        : rows(occupancy[block.x + blocks * (block.y + blocks * block.z)]);
}

// Each voxel of a block, or the next one along x.
uvec2 spread_x(uvec3 block, uint blocks) {
    uvec2 own = block_at(block, blocks), next = block_at(block + uvec3(1, 0, 0), blocks);
    return own | own >> 1 & 0x77777777u | next << 3 & 0x88888888u;
}

// The same along x and y.
uvec2 spread_xy(uvec3 block, uint blocks) {
    uvec2 own = spread_x(block, blocks), next = spread_x(block + uvec3(0, 1, 0), blocks);
    return own | own >> 4 & 0x0fff0fffu | next << 12 & 0xf000f000u;
}

void main() {
    uint blocks = uint(imageSize(matter).x);
    uint index = gl_GlobalInvocationID.x;
    if (index >= blocks * blocks * blocks) return;
    uvec3 block = uvec3(index % blocks, index / blocks % blocks, index / (blocks * blocks));
    uvec2 own = spread_xy(block, blocks), next = spread_xy(block + uvec3(0, 0, 1), blocks);
    ivec3 texel = ivec3(block.xy, 2u * block.z);
    imageStore(matter, texel, uvec4(own.x | own.x >> 16 | own.y << 16));
    imageStore(matter, texel + ivec3(0, 0, 1), uvec4(own.y | own.y >> 16 | next.x << 16));
}
