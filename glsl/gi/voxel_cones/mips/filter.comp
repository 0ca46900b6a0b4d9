#version 460
#extension GL_GOOGLE_include_directive : require
// voxel_mips.filter: one mip of radiance premultiplied by opacity from the next finer one. The six
// faces of a mip are cubes side by side along x.
layout(local_size_x = 4, local_size_y = 4, local_size_z = 4) in;

#include "gi/shared/voxel/prefilter.glsl"

// as `mode` of filter_eight, of a mip without faces
layout(constant_id = 0) const uint FILTER = 1;
layout(constant_id = 1) const bool FACES = false;
layout(constant_id = 2) const bool FINER_FACES = false;

layout(set = 1, binding = 0, rgba16f) uniform restrict readonly image3D finer;
layout(set = 1, binding = 1, rgba16f) uniform restrict writeonly image3D coarser;

void main() {
    ivec3 texel = ivec3(gl_GlobalInvocationID), size = imageSize(coarser);
    if (any(greaterThanEqual(texel, size))) return;
    int face = FACES ? texel.x / size.y : 0;
    ivec3 first = 2 * texel;
    first.x -= FINER_FACES ? 0 : 2 * face * size.y;
    vec4 c[8];
    for (int i = 0; i < 8; ++i)
        c[i] = imageLoad(
            finer, first + (FACES ? face_child(i, face) : ivec3(i & 1, i >> 1 & 1, i >> 2)));
    vec4 result;
    if (FACES) {
        result = filter_face(c);
    } else {
        result = filter_eight(c, FILTER);
    }
    imageStore(coarser, texel, result);
}
