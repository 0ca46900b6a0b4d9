#version 460
#extension GL_GOOGLE_include_directive : require
// clipmap.write_voxels: the radiance of a level's voxels in some region, or the mean normal of what
// shines of them, premultiplied by opacity, into its texels, but where those of the next finer
// level alone are shown. A thread a voxel.
layout(local_size_x = 64) in;

#include "gi/shared/voxel/records.glsl"

layout(constant_id = 0) const bool FACES = false;
// each face of a voxel has a radiance and an opacity
layout(constant_id = 1) const bool SIX = false;
layout(constant_id = 2) const uint SIDES = 1;   // radiances of a voxel: 1, 2, 6
// 0: a radiance for all directions; of texels that shine by their normals, 1: both sides together,
// 2: the mean normal of what shines, times its luminance
layout(constant_id = 3) const uint WRITTEN = 0;

layout(std430, set = 1, binding = 0) restrict readonly buffer Voxels { Voxel voxels[]; };
layout(std430, set = 1, binding = 1) restrict readonly buffer VoxelRadiance {
    uvec2 voxel_radiance[];
};
layout(set = 1, binding = 2, rgba16f) uniform restrict writeonly image3D clipmap;

#include "gi/shared/voxel/light/lit_normals.glsl"
#include "gi/shared/voxel/light/merged.glsl"
#include "gi/voxel_cones/clipmap/store.glsl"

layout(push_constant) uniform WriteParams {
    ivec4 first;         // xyz: first voxel of the level modulo n; w: n
    // xyz: first voxel of the box that is made from the finer level alone, from the level's own
    ivec4 core_low;
    ivec4 core_end;
    ivec4 region_low;    // xyz: first voxel that is written, from the level's own
    ivec4 region_end;
    uint voxel_count;
    int clipmap_level;
} params;

vec4 light_of(uint index) {
    vec4 front = side_of_voxel(2u * index), back = side_of_voxel(2u * index + 1u);
    vec3 light = min(front.rgb + back.rgb, vec3(LARGEST_HALF));
    if (WRITTEN == 2u) light = lit_normal(voxels[index], front.rgb, back.rgb);
    return vec4(light, front.w);
}

void main() {
    uint index = gl_GlobalInvocationID.x + gl_GlobalInvocationID.y * 4194240u;
    if (index >= params.voxel_count) return;
    ivec3 voxel = ivec3(voxel_coordinates(voxels[index].xy, voxels[index].z_area));
    if (all(greaterThanEqual(voxel, params.core_low.xyz))
        && all(lessThan(voxel, params.core_end.xyz)))
        return;
    if (any(lessThan(voxel, params.region_low.xyz))
        || any(greaterThanEqual(voxel, params.region_end.xyz)))
        return;
    ivec3 texel = voxel + params.first.xyz & params.first.w - 1;
    int faces = 1;
    if (FACES) faces = 6;
    for (int face = 0; face < faces; ++face) {
        vec4 light;
        if (WRITTEN != 0u) light = light_of(index);
        else if (SIX) light = side_of_voxel(6u * index + uint(face));
        else light = merged_radiance(index);
        store_texel(texel, face, params.clipmap_level, params.first.w,
            vec4(light.rgb * light.w, light.w));
    }
}
