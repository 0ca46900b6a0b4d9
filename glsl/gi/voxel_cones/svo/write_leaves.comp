#version 460
#extension GL_GOOGLE_include_directive : require
// svo.write_leaves: radiance premultiplied by opacity, and opacity; of voxels with two radiances,
// of both sides together.
layout(local_size_x = 64) in;

#include "gi/voxel_cones/svo/touched.glsl"

// radiances of a voxel: 1, 2, or 6, one a face, and then as many bricks of a tile
layout(constant_id = 1) const uint SIDES = 1;
// 1: normal bricks tell the sides of a voxel apart
layout(constant_id = 3) const uint NORMALS = 0;

const float LARGEST_HALF = 65504.0;

layout(std430, set = 1, binding = 0) restrict readonly buffer Nodes { uint nodes[]; };
layout(std430, set = 1, binding = 1) restrict readonly buffer VoxelRadiance {
    uvec2 voxel_radiance[];
};
layout(set = 1, binding = 2, rgba16f) uniform restrict writeonly image3D bricks;
layout(std430, set = 1, binding = 3) restrict readonly buffer TouchedLevels {
    Touched touched_levels[];
};
layout(std430, set = 1, binding = 4) restrict readonly buffer TouchedTiles {
    uint touched_tiles[];
};

layout(push_constant) uniform BrickParams {
    uint first;            // static tile of the level
    uint count;
    uint first_dynamic;
    uint dynamic_count;
    uint level;
    uint shift;            // bricks from a tile's index to that of its first brick
    uint stride;           // from a face to the next
    uint child_shift;
    uint child_stride;
} params;

// Radiance and opacity.
vec4 side_of_voxel(uint side) {
    uvec2 packed = voxel_radiance[side];
    return vec4(unpackHalf2x16(packed.x), unpackHalf2x16(packed.y));
}

vec4 voxel_texel(uint voxel, uint face) {
    vec4 light = side_of_voxel(SIDES * voxel + face);
    if (SIDES == 2u) {
        vec4 back = side_of_voxel(2u * voxel + 1u);
        light.rgb += back.rgb;
        // seen by one radiance for all directions
        if (NORMALS == 0u) light.rgb *= back.w;
        light.rgb = min(light.rgb, vec3(LARGEST_HALF));
    }
    return vec4(light.rgb * light.a, light.a);
}

uint brick_of(uint tile, uint face) {
    return tile + params.shift + face * params.stride;
}

bool is_of_piece(uint tile) {
    return true;
}

#include "gi/voxel_cones/svo/leaves.glsl"

void main() {
    uint faces = 1u;
    if (SIDES == 6u) faces = 6u;
    write_leaves(faces);
}
