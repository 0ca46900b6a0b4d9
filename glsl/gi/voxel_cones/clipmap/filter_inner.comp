#version 460
#extension GL_GOOGLE_include_directive : require
// clipmap.filter_inner: the texels of a level, in some region, where the next finer one is shown
// whole, from its texels; towards the end of that, mixed with those of the level's own voxels, so
// that little changes when it moves on. A thread a texel.
layout(local_size_x = 4, local_size_y = 4, local_size_z = 4) in;

#include "gi/shared/voxel/grid.glsl"
#include "gi/shared/voxel/prefilter.glsl"

// as `mode` of filter_eight, of a level without faces
layout(constant_id = 0) const uint FILTER = 1;
layout(constant_id = 1) const bool FACES = false;
// the finer level has six too, not one for all
layout(constant_id = 2) const bool FINER_FACES = false;

layout(set = 1, binding = 0, rgba16f) uniform restrict image3D clipmap;
layout(std430, set = 1, binding = 1) restrict readonly buffer Occupancy { uvec2 occupancy[]; };

#include "gi/voxel_cones/clipmap/store.glsl"

layout(push_constant) uniform InnerParams {
    ivec4 first;         // xyz: first voxel that is made, modulo n; w: n
    ivec4 region_low;    // xyz: the same from the level's first
    ivec4 region_size;
    // xyz: middle of the place where the finer level is shown, from the first voxel [half voxels];
    // w: how far it reaches [voxels]
    ivec4 inner_middle;
    int inner_level;     // this one
    int inner_ramp;      // over which both are mixed [voxels]
} params;

void main() {
    int n = params.first.w;
    ivec3 at = ivec3(gl_GlobalInvocationID);
    if (any(greaterThanEqual(at, params.region_size.xyz))) return;
    ivec3 voxel = params.first.xyz + at;
    ivec3 aside = abs(2 * at + 1 - params.inner_middle.xyz);
    float depth = float(params.inner_middle.w) - 0.5 * float(max(aside.x, max(aside.y, aside.z)));
    float own_share = max(1.0 - depth / float(params.inner_ramp), 0.0);
    // Where it has no voxel, what its texel holds is left from before.
    uvec3 own_voxel = uvec3(at + params.region_low.xyz);
    bool has_voxel =
        block_has(occupancy[block_index(own_voxel, uint(n))], block_bit(own_voxel));
    int faces = 1;
    if (FACES) faces = 6;
    for (int face = 0; face < faces; ++face) {
        vec4 c[8];
        for (int i = 0; i < 8; ++i) {
            ivec3 child = FACES ? face_child(i, face) : ivec3(i & 1, i >> 1 & 1, i >> 2);
            c[i] = imageLoad(clipmap,
                level_texel(
                    2 * voxel + child & n - 1, FINER_FACES ? face : 0, params.inner_level - 1, n));
        }
        vec4 result;
        if (FACES) {
            result = filter_face(c);
        } else {
            result = filter_eight(c, FILTER);
        }
        vec4 own = imageLoad(clipmap, level_texel(voxel & n - 1, face, params.inner_level, n));
        own = has_voxel ? own : vec4(0.0);
        // What lies deeper has no voxels of its own here.
        store_texel(voxel & n - 1, face, params.inner_level, n,
            own_share > 0.0 ? mix(result, own, own_share) : result);
    }
}
