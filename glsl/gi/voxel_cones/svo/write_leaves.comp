#version 460
#extension GL_GOOGLE_include_directive : require
// svo.write_leaves: radiance premultiplied by opacity, and opacity; of voxels with several
// radiances, of all together, or each into a brick of its own.
layout(local_size_x = 64) in;

#include "gi/voxel_cones/svo/touched.glsl"

layout(constant_id = 1) const uint SIDES = 1;   // radiances of a voxel: 1, 2, 6
// 1: normal bricks tell the sides of a voxel apart
layout(constant_id = 3) const uint NORMALS = 0;
// 1: of six radiances, with an opacity each, each has a brick
layout(constant_id = 4) const uint FACES = 0;

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

#include "gi/shared/voxel/light/merged.glsl"

vec4 voxel_texel(uint voxel, uint face) {
    vec4 light;
    if (FACES != 0u) {
        light = side_of_voxel(SIDES * voxel + face);
    } else if (NORMALS != 0u) {
        light = side_of_voxel(2u * voxel);
        light.rgb = min(light.rgb + side_of_voxel(2u * voxel + 1u).rgb, vec3(LARGEST_HALF));
    } else {
        light = merged_radiance(voxel);
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
    if (FACES != 0u) faces = 6u;
    write_leaves(faces);
}
