#version 460
#extension GL_GOOGLE_include_directive : require
// voxel_mips.clear_dynamic: the texels of the voxels that dynamic geometry touched, and of those
// around them, become empty. A thread a voxel.
layout(local_size_x = 64) in;

#include "gi/shared/voxel/records.glsl"

layout(std430, set = 1, binding = 0) restrict readonly buffer Voxels { Voxel voxels[]; };
layout(set = 1, binding = 1, rgba16f) uniform restrict writeonly image3D cleared;

layout(push_constant) uniform ClearParams { uint first_voxel; uint voxel_count; } params;

void main() {
    uint index = gl_GlobalInvocationID.x + gl_GlobalInvocationID.y * 4194240u;
    if (index >= params.voxel_count) return;
    Voxel voxel = voxels[params.first_voxel + index];
    // One cube, or those of six faces side by side.
    ivec3 size = imageSize(cleared),
          texel = ivec3(voxel_coordinates(voxel.xy, voxel.z_area));
    for (; texel.x < size.x; texel.x += size.y) imageStore(cleared, texel, vec4(0.0));
}
