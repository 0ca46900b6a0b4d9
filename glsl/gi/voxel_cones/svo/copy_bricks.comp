#version 460
#extension GL_GOOGLE_include_directive : require
// svo.copy_bricks: the first bricks of a pool into another, larger one. A thread a texel.
layout(local_size_x = 64) in;

#include "gi/voxel_cones/svo/pool.glsl"

layout(set = 1, binding = 0, rgba16f) uniform restrict readonly image3D bricks;
layout(set = 1, binding = 1, rgba16f) uniform restrict writeonly image3D larger_bricks;

layout(push_constant) uniform CopyBricksParams { uint brick_count; } params;

void main() {
    uint thread = linear_group(gl_WorkGroupID) * 64u + gl_LocalInvocationIndex;
    uint brick = thread / 27u, texel = thread % 27u;
    if (brick >= params.brick_count) return;
    ivec3 at = ivec3(texel % 3u, texel / 3u % 3u, texel / 9u);
    imageStore(larger_bricks, brick_texel(brick, imageSize(larger_bricks)) + at,
        imageLoad(bricks, brick_texel(brick, imageSize(bricks)) + at));
}
