#version 460
#extension GL_GOOGLE_include_directive : require
// clipmap.pack_blocks: the blocks of a level among those of all levels.
layout(local_size_x = 64) in;

layout(std430, set = 1, binding = 0) restrict readonly buffer Occupancy { uvec2 occupancy[]; };
layout(std430, set = 1, binding = 1) restrict readonly buffer BlockBases { uint block_bases[]; };
// three words a block: occupancy of its voxels, number of the first
layout(std430, set = 1, binding = 2) restrict writeonly buffer Blocks { uint blocks[]; };

layout(push_constant) uniform PackBlocksParams {
    uint block_count;   // of a level
    uint first_block;   // of all finer levels
    uint first_voxel;   // number of the level's first voxel among those of all levels
} params;

void main() {
    uint index = gl_GlobalInvocationID.x + gl_GlobalInvocationID.y * 4194240u;
    if (index >= params.block_count) return;
    uvec2 words = occupancy[index];
    uint at = 3u * (params.first_block + index);
    blocks[at] = words.x;
    blocks[at + 1u] = words.y;
    blocks[at + 2u] = params.first_voxel + block_bases[index];
}
