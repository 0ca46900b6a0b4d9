#version 460
#extension GL_GOOGLE_include_directive : require
// voxel.empty_blocks: the blocks of a box become empty, to be voxelized anew. A thread a block of
// the box.
layout(local_size_x = 64) in;

#include "gi/shared/voxel/window/window.glsl"

layout(std430, set = 1, binding = 0) restrict writeonly buffer ShiftedOccupancy {
    uvec2 shifted_occupancy[];
};
layout(std430, set = 1, binding = 1) restrict writeonly buffer MovedFrom { uint moved_from[]; };

layout(push_constant) uniform EmptyParams {
    uint first_x;   // block of the box
    uint first_y;
    uint first_z;
    uint size_x;    // of the box [blocks]
    uint size_y;
    uint size_z;
    uint blocks;    // along an edge of the window
} params;

void main() {
    uint thread = gl_GlobalInvocationID.x;
    if (thread >= params.size_x * params.size_y * params.size_z) return;
    uvec3 at = uvec3(thread % params.size_x, thread / params.size_x % params.size_y,
        thread / (params.size_x * params.size_y));
    at += uvec3(params.first_x, params.first_y, params.first_z);
    uint block = at.x + params.blocks * (at.y + params.blocks * at.z);
    shifted_occupancy[block] = uvec2(0u);
    moved_from[block] = NEW_BLOCK;
}
