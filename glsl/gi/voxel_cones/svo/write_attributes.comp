#version 460
#extension GL_GOOGLE_include_directive : require
// svo.write_attributes: an attribute of the voxels premultiplied by opacity, and opacity.
layout(local_size_x = 64) in;

#include "gi/voxel_cones/svo/pieces.glsl"
#include "gi/voxel_cones/svo/touched.glsl"
#include "gi/shared/voxel/records.glsl"

layout(constant_id = 1) const uint ATTRIBUTE = 0;   // 0: albedo, 1: mean normal, 2: emission

layout(std430, set = 1, binding = 0) restrict readonly buffer Nodes { uint nodes[]; };
layout(set = 1, binding = 1, rgba16f) uniform restrict writeonly image3D bricks;
// of a piece of the grid
layout(std430, set = 1, binding = 2) restrict readonly buffer VoxelRecords {
    Voxel voxel_records[];
};
// likewise, where there is emission
layout(std430, set = 1, binding = 3) restrict readonly buffer VoxelEmission {
    vec4 voxel_emission[];
};
layout(std430, set = 1, binding = 4) restrict readonly buffer TouchedLevels {
    Touched touched_levels[];
};
layout(std430, set = 1, binding = 5) restrict readonly buffer TouchedTiles {
    uint touched_tiles[];
};

vec4 voxel_texel(uint voxel, uint face) {
    uint index = voxel - params.first_voxel;
    Voxel record = voxel_records[index];
    vec3 value = unpack_albedo(record.albedo);
    if (ATTRIBUTE == 1u) value = unpack_mean_normal(record.normal);
    if (ATTRIBUTE == 2u) value = min(voxel_emission[index].rgb, vec3(LARGEST_HALF));
    float opacity = unpack_coverage(record.coverage);
    return vec4(value * opacity, opacity);
}

#include "gi/voxel_cones/svo/leaves.glsl"

void main() {
    write_leaves(1u);
}
