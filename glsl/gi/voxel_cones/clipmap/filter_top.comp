#version 460
#extension GL_GOOGLE_include_directive : require
// clipmap.filter_top: a box of one mip above the outermost level, from that level or the mip
// before. Mips begin where the level does: their texels are not modulo anything. The six faces of a
// mip are cubes side by side along x. A thread a texel.
layout(local_size_x = 4, local_size_y = 4, local_size_z = 4) in;

#include "gi/shared/voxel/prefilter.glsl"

// as `mode` of filter_eight, of a mip without faces
layout(constant_id = 0) const uint FILTER = 1;
layout(constant_id = 1) const bool FACES = false;
layout(constant_id = 2) const bool FINER_FACES = false;
layout(constant_id = 3) const bool FROM_LEVEL = false;   // `finer` is the texture of the levels

#include "gi/voxel_cones/clipmap/atlas.glsl"

layout(set = 1, binding = 0, rgba16f) uniform restrict readonly image3D finer;
layout(set = 1, binding = 1, rgba16f) uniform restrict writeonly image3D coarser;

layout(push_constant) uniform TopParams {
    ivec4 first;         // xyz: first voxel of the outermost level modulo n; w: n
    ivec4 region_low;    // xyz: first texel that is made
    ivec4 region_size;
    int finer_level;     // the outermost
} params;

void main() {
    ivec3 at = ivec3(gl_GlobalInvocationID), region = params.region_size.xyz;
    int face = FACES ? at.x / region.x : 0, finer_face = FINER_FACES ? face : 0, n = params.first.w,
        edge = imageSize(coarser).y;
    at.x -= face * region.x;
    if (any(greaterThanEqual(ivec4(at, face), ivec4(region, 6)))) return;
    ivec3 texel = at + params.region_low.xyz, first = 2 * texel;
    vec4 c[8];
    for (int i = 0; i < 8; ++i) {
        ivec3 child = first + (FACES ? face_child(i, face) : ivec3(i & 1, i >> 1 & 1, i >> 2));
        if (FROM_LEVEL) {
            child =
                level_texel(child + params.first.xyz & n - 1, finer_face, params.finer_level, n);
        } else {
            child.x += finer_face * 2 * edge;
        }
        c[i] = imageLoad(finer, child);
    }
    vec4 result;
    if (FACES) {
        result = filter_face(c);
    } else {
        result = filter_eight(c, FILTER);
    }
    imageStore(coarser, texel + ivec3(face * edge, 0, 0), result);
}
