#version 460
// voxel.pack_blocks: blocks of a grid as rays read them (gi/shared/voxel/trace/blocks.glsl), from a
// given layer on. A thread a block, a workgroup a cube of 16³ voxels.
layout(local_size_x = 4, local_size_y = 4, local_size_z = 4) in;

layout(std430, set = 1, binding = 0) restrict readonly buffer Occupancy { uvec2 occupancy[]; };
layout(std430, set = 1, binding = 1) restrict readonly buffer BlockBases { uint block_bases[]; };
layout(set = 1, binding = 2, rgba32ui) uniform restrict writeonly uimage3D blocks;

layout(push_constant) uniform PackBlocksParams {
    // box of voxels that rays see in another grid: no empty cube of more than a block reaches in
    ivec4 hidden_low;
    ivec4 hidden_end;
    // xyz: blocks between the grid's corner and the last corner of a cube of 16³ before it
    ivec4 cube_offset;
    uint blocks_along;   // an edge of the grid
    uint first_layer;    // that is written
    uint first_voxel;    // number of the grid's first voxel
} params;

// Of each 2³ blocks, whether one has voxels, is outside of the grid or in the box.
shared uint filled[8];

void main() {
    uvec3 at = gl_GlobalInvocationID - uvec3(params.cube_offset.xyz),
          part = gl_LocalInvocationID >> 1;
    uint n = params.blocks_along, own = part.x + 2u * (part.y + 2u * part.z);
    uint index = at.x + n * (at.y + n * at.z);
    // Below 0 it is a large number.
    bool is_inside = all(lessThan(at, uvec3(n)));
    uvec2 words = uvec2(0u);
    if (is_inside) words = occupancy[index];
    if (gl_LocalInvocationIndex < 8u) filled[gl_LocalInvocationIndex] = 0u;
    barrier();
    ivec3 low = 4 * ivec3(at);
    bool is_hidden = all(lessThan(low, params.hidden_end.xyz))
        && all(greaterThan(low + 4, params.hidden_low.xyz));
    if (!is_inside || is_hidden || (words.x | words.y) != 0u) atomicOr(filled[own], 1u);
    barrier();
    if (!is_inside) return;
    uint all = 0u;
    for (uint i = 0u; i < 8u; ++i) all |= filled[i];
    uint third = all == 0u ? 16u : filled[own] == 0u ? 8u : 4u;
    if ((words.x | words.y) != 0u) third = params.first_voxel + block_bases[index];
    imageStore(
        blocks, ivec3(at) + ivec3(0, 0, params.first_layer), uvec4(words, third, 0u));
}
