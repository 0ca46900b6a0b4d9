// The space of gi/shared/voxel/trace/space.glsl as a dense grid of voxels with their light (Rust:
// LitGrid). The including pass declares `params`, whose `resolution` is that of the grid.
#include "shared/frame.glsl"
#include "gi/shared/voxel/records.glsl"

layout(constant_id = SPACE_CONSTANT) const uint SIDES = 1;   // radiances of a voxel: 1, 2, 6

layout(set = 1, binding = SPACE_BINDING) uniform utexture3D blocks;
layout(std430, set = 1, binding = SPACE_BINDING + 1) restrict readonly buffer VoxelRecords {
    Voxel voxel_records[];
};
layout(std430, set = 1, binding = SPACE_BINDING + 2) restrict readonly buffer VoxelRadiance {
    uvec2 voxel_radiance[];
};

#include "gi/shared/voxel/trace/blocks.glsl"
#include "gi/shared/voxel/trace/radiance.glsl"

SpaceCell cell_around(ivec3 place) {
    return cell_of_block(texelFetch(usampler3D(blocks, nearest_clamp), place >> 2, 0).xyz,
        block_bit(uvec3(place)));
}

float voxel_edge(vec3 position) {
    return 1.0;
}

Voxel surface_of(uint slot) {
    return voxel_records[slot];
}
