#version 460
#extension GL_GOOGLE_include_directive : require
// voxel.move_records: the records of blocks that stay in a window go to their new places, with
// their new coordinates. A thread a block.
layout(local_size_x = 64) in;

#include "gi/shared/voxel/window/window.glsl"
#include "gi/shared/voxel/records.glsl"

layout(constant_id = 0) const uint EMISSIVE = 0;
// Pairs of words of light that move along with each voxel; 0 in new ones.
layout(constant_id = 1) const uint CARRIED = 0;
layout(constant_id = 2) const bool FACES = false;

layout(std430, set = 1, binding = 0) restrict readonly buffer MovedFrom { uint moved_from[]; };
layout(std430, set = 1, binding = 1) restrict readonly buffer Occupancy { uvec2 occupancy[]; };
layout(std430, set = 1, binding = 2) restrict readonly buffer BlockBases { uint block_bases[]; };
layout(std430, set = 1, binding = 3) restrict readonly buffer OldVoxels { Voxel old_voxels[]; };
layout(std430, set = 1, binding = 4) restrict writeonly buffer Voxels { Voxel voxels[]; };
layout(std430, set = 1, binding = 5) restrict readonly buffer OldEmission { vec4 old_emission[]; };
layout(std430, set = 1, binding = 6) restrict writeonly buffer VoxelEmission {
    vec4 voxel_emission[];
};
layout(std430, set = 1, binding = 7) restrict readonly buffer OldCarried { uvec2 old_carried[]; };
layout(std430, set = 1, binding = 8) restrict writeonly buffer Carried { uvec2 carried[]; };

layout(std430, set = 1, binding = 9) restrict readonly buffer OldFaces { uvec2 old_faces[]; };
layout(std430, set = 1, binding = 10) restrict writeonly buffer VoxelFaces { uvec2 voxel_faces[]; };

layout(push_constant) uniform MoveParams {
    uint block_count;
    uint shift_xy;   // that the window has moved by [voxels]: x + 2¹⁶ y, modulo 2³²
    uint shift_z;
} params;

void main() {
    uint block = gl_GlobalInvocationID.x;
    if (block >= params.block_count) return;
    uint from = moved_from[block], to = block_bases[block];
    uint count = uint(bitCount(occupancy[block].x) + bitCount(occupancy[block].y));
    for (uint i = 0u; i < count; ++i) {
        bool stays = from != NEW_BLOCK;
        if (stays) {
            Voxel voxel = old_voxels[from + i];
            voxel.xy -= params.shift_xy;
            voxel.z_area -= params.shift_z;
            voxels[to + i] = voxel;
            if (EMISSIVE != 0u) voxel_emission[to + i] = old_emission[from + i];
            if (FACES) voxel_faces[to + i] = old_faces[from + i];
        }
        for (uint part = 0u; part < CARRIED; ++part) {
            carried[CARRIED * (to + i) + part] =
                stays ? old_carried[CARRIED * (from + i) + part] : uvec2(0u);
        }
    }
}
