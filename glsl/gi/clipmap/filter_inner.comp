#version 460
#extension GL_GOOGLE_include_directive : require
// clipmap.filter_inner: the texels of a level where the next finer one lies, from its texels. A thread a texel.
layout(local_size_x = 4, local_size_y = 4, local_size_z = 4) in;

#include "gi/voxel/prefilter.glsl"

layout(constant_id = 0) const uint FILTER = 1;   // as `mode` of filter_eight

layout(set = 1, binding = 0, rgba16f) uniform restrict image3D clipmap;

#include "gi/clipmap/store.glsl"

layout(push_constant) uniform InnerParams {
    ivec4 first;         // xyz: first voxel of the finer level, in voxels of this one, modulo n; w: n
    int inner_level;     // this one
} params;

void main() {
    int n = params.first.w;
    ivec3 at = ivec3(gl_GlobalInvocationID);
    if (any(greaterThanEqual(at, ivec3(n / 2)))) return;
    ivec3 voxel = params.first.xyz + at;
    vec4 c[8];
    for (int i = 0; i < 8; ++i) {
        ivec3 finer = 2 * voxel + ivec3(i & 1, i >> 1 & 1, i >> 2) & n - 1;
        c[i] = imageLoad(clipmap, ivec3(finer.xy, slab_layer(params.inner_level - 1, n) + finer.z));
    }
    store_texel(voxel & n - 1, params.inner_level, n, filter_eight(c, FILTER));
}
