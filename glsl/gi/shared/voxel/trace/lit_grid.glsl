// The space of gi/shared/voxel/trace/space.glsl as a dense grid of voxels with their light (Rust:
// LitGrid).
#include "gi/shared/voxel/records.glsl"

layout(constant_id = SPACE_CONSTANT) const uint SIDES = 1;   // radiances of a voxel: 1, 2, 6

layout(std430, set = 1, binding = SPACE_BINDING) restrict readonly buffer Occupancy {
    uvec2 occupancy[];
};
layout(std430, set = 1, binding = SPACE_BINDING + 1) restrict readonly buffer BlockBases {
    uint block_bases[];
};
layout(std430, set = 1, binding = SPACE_BINDING + 2) restrict readonly buffer VoxelRecords {
    Voxel voxel_records[];
};
layout(std430, set = 1, binding = SPACE_BINDING + 3) restrict readonly buffer VoxelRadiance {
    uvec2 voxel_radiance[];
};

#include "gi/shared/voxel/trace/dense.glsl"
#include "gi/shared/voxel/trace/radiance.glsl"

Voxel surface_of(uint slot) {
    return voxel_records[slot];
}
