#version 460
#extension GL_GOOGLE_include_directive : require
// svo.merge_occupancy: a piece of the grid, voxelized by itself, into the whole: its occupancy, and the compact indices of its blocks after those of the
// pieces before it. A thread a block.
layout(local_size_x = 64) in;

layout(std430, set = 1, binding = 0) restrict readonly buffer PieceOccupancy { uvec2 piece_occupancy[]; };
layout(std430, set = 1, binding = 1) restrict readonly buffer PieceBases { uint piece_bases[]; };
layout(std430, set = 1, binding = 2) restrict writeonly buffer Occupancy { uvec2 occupancy[]; };
layout(std430, set = 1, binding = 3) restrict writeonly buffer BlockBases { uint block_bases[]; };

layout(push_constant) uniform MergeParams {
    uint piece_blocks;   // along an axis
    uint blocks;         // of the whole grid, likewise
    uint first_x;        // block of the whole grid at which the piece starts
    uint first_y;
    uint first_z;
    uint first_voxel;
} params;

void main() {
    uint index = gl_GlobalInvocationID.x + gl_GlobalInvocationID.y * 4194240u;
    uint n = params.piece_blocks;
    if (index >= n * n * n) return;
    uvec3 block = uvec3(index % n, index / n % n, index / (n * n)) + uvec3(params.first_x, params.first_y, params.first_z);
    uint target = block.x + params.blocks * (block.y + params.blocks * block.z);
    occupancy[target] = piece_occupancy[index];
    block_bases[target] = params.first_voxel + piece_bases[index];
}
