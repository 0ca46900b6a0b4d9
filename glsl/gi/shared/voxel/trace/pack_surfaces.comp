#version 460
#extension GL_GOOGLE_include_directive : require
// voxel.pack_surfaces: what rays read of each voxel.
layout(local_size_x = 64) in;

#include "gi/shared/voxel/records.glsl"

layout(std430, set = 1, binding = 0) restrict readonly buffer Voxels { Voxel voxels[]; };
layout(std430, set = 1, binding = 1) restrict writeonly buffer Surfaces { uint surfaces[]; };

layout(push_constant) uniform PackParams {
    uint first_voxel;   // number of the first voxel among all
    uint voxel_count;
} params;

void main() {
    uint index = gl_GlobalInvocationID.x + gl_GlobalInvocationID.y * 4194240u;
    if (index >= params.voxel_count) return;
    uvec3 surface = pack_surface(voxels[index]);
    for (uint word = 0u; word < 3u; ++word)
        surfaces[3u * (params.first_voxel + index) + word] = surface[word];
}
