#version 460
#extension GL_GOOGLE_include_directive : require
// clipmap.clear_box: the texels of a box of a level become empty. A thread a texel.
layout(local_size_x = 4, local_size_y = 4, local_size_z = 4) in;

layout(constant_id = 0) const bool FACES = false;

layout(set = 1, binding = 0, rgba16f) uniform restrict writeonly image3D clipmap;

#include "gi/voxel_cones/clipmap/store.glsl"

layout(push_constant) uniform ClearBoxParams {
    ivec4 first;         // xyz: first voxel of the box modulo n; w: n
    ivec4 size;          // xyz: of the box [voxels]; w: level
} params;

void main() {
    ivec3 at = ivec3(gl_GlobalInvocationID);
    if (any(greaterThanEqual(at, params.size.xyz))) return;
    ivec3 texel = at + params.first.xyz & params.first.w - 1;
    int faces = 1;
    if (FACES) faces = 6;
    for (int face = 0; face < faces; ++face)
        store_texel(texel, face, params.size.w, params.first.w, vec4(0.0));
}
