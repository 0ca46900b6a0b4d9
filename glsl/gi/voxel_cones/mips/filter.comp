#version 460
#extension GL_GOOGLE_include_directive : require
// voxel_mips.filter: one mip of radiance premultiplied by opacity from the next finer one, where it
// may be other than zero. The six faces of a mip are cubes side by side along x.
layout(local_size_x = 4, local_size_y = 4, local_size_z = 4) in;

#include "gi/shared/voxel/prefilter.glsl"
#include "gi/voxel_cones/mips/groups.glsl"

// as `mode` of filter_eight, of a mip without faces
layout(constant_id = 0) const uint FILTER = 1;
layout(constant_id = 1) const bool FACES = false;
layout(constant_id = 2) const bool FINER_FACES = false;

layout(set = 1, binding = 0, rgba16f) uniform restrict readonly image3D finer;
layout(set = 1, binding = 1, rgba16f) uniform restrict writeonly image3D coarser;

layout(std430, set = 1, binding = 2) restrict readonly buffer FilterGroups { uint groups[]; };

layout(push_constant) uniform FilterParams {
    uint first_word;   // of the mip's list
} params;

void main() {
    uint at = gl_WorkGroupID.x + GROUPS_ALONG * gl_WorkGroupID.y, head = params.first_word;
    if (at >= groups[head + 3u]) return;
    int size = imageSize(coarser).y, face = int(gl_WorkGroupID.z);
    ivec3 group = group_at(int(groups[head + GROUP_HEAD + at]), group_row(size)),
          texel = 4 * group + ivec3(gl_LocalInvocationID);
    if (any(greaterThanEqual(texel, ivec3(size)))) return;
    ivec3 first = 2 * texel;
    if (FINER_FACES) first.x += 2 * face * size;
    texel.x += face * size;
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
