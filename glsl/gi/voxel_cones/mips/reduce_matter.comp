#version 460
#extension GL_GOOGLE_include_directive : require
// voxel_mips.reduce_matter: a mip of the matter pyramid (gi/voxel_cones/matter.glsl) from the
// next finer one. A thread makes a word.
layout(local_size_x = 4, local_size_y = 4, local_size_z = 4) in;

#include "gi/voxel_cones/matter.glsl"

layout(set = 1, binding = 0, r32ui) uniform restrict uimage3D matter;

layout(push_constant) uniform MatterParams {
    int mip;   // that is made
} params;

void main() {
    int size = 4 * imageSize(matter).x;
    ivec3 stencil = ivec3(gl_GlobalInvocationID) * ivec3(4, 4, 2);
    if (any(greaterThanEqual(stencil, ivec3(size >> params.mip)))) return;
    uint word = 0u;
    for (int i = 0; i < 75; ++i) {
        ivec3 part = ivec3(i % 5, i / 5 % 5, i / 25);
        ivec3 texel = stencil + part;
        if (any(greaterThanEqual(texel, ivec3(size >> params.mip)))) continue;
        // A texel of this mip is an even stencil of the finer one; it is in the stencils of its own
        // index and of the one before.
        ivec3 finer = 2 * texel;
        uint is_there =
            imageLoad(matter, matter_texel(finer, size, params.mip - 1)).r >> stencil_bit(finer)
            & 1u;
        uint x = 3u << part.x >> 1 & 15u, y = 0x11u << 4 * part.y >> 4 & 0x1111u;
        uint z = uint(part.z < 2) | uint(part.z > 0) << 16;
        word |= is_there * x * y * z;
    }
    imageStore(matter, matter_texel(stencil, size, params.mip), uvec4(word));
}
