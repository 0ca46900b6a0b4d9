#version 460
#extension GL_GOOGLE_include_directive : require
// svo.write_normals: the mean normal of what shines, times its luminance
// (gi/shared/voxel/light/lit_normals.glsl) and opacity, and opacity.
layout(local_size_x = 64) in;

#include "gi/voxel_cones/svo/pieces.glsl"
#include "gi/voxel_cones/svo/touched.glsl"
#include "gi/shared/voxel/records.glsl"
#include "gi/shared/voxel/light/lit_normals.glsl"

layout(std430, set = 1, binding = 0) restrict readonly buffer Nodes { uint nodes[]; };
// two sides a voxel
layout(std430, set = 1, binding = 1) restrict readonly buffer VoxelRadiance {
    uvec2 voxel_radiance[];
};
layout(set = 1, binding = 2, rgba16f) uniform restrict writeonly image3D bricks;
// of a piece of the grid
layout(std430, set = 1, binding = 3) restrict readonly buffer VoxelRecords {
    Voxel voxel_records[];
};
layout(std430, set = 1, binding = 4) restrict readonly buffer TouchedLevels {
    Touched touched_levels[];
};
layout(std430, set = 1, binding = 5) restrict readonly buffer TouchedTiles {
    uint touched_tiles[];
};

// Radiance and opacity.
vec4 side_of_voxel(uint side) {
    uvec2 packed = voxel_radiance[side];
    return vec4(unpackHalf2x16(packed.x), unpackHalf2x16(packed.y));
}

vec4 voxel_texel(uint voxel, uint face) {
    vec4 front = side_of_voxel(2u * voxel), back = side_of_voxel(2u * voxel + 1u);
    Voxel record = voxel_records[voxel - params.first_voxel];
    return vec4(lit_normal(record, front.rgb, back.rgb) * front.a, front.a);
}

#include "gi/voxel_cones/svo/leaves.glsl"

void main() {
    write_leaves(1u);
}
