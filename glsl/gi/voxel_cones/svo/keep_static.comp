#version 460
#extension GL_GOOGLE_include_directive : require
// svo.keep_static: the texels of dynamic tiles' bricks that dynamic geometry does not reach become
// those of the static tile, or zero where there is none. A thread a texel.
layout(local_size_x = 64) in;

#include "gi/voxel_cones/svo/dynamic.glsl"
#include "gi/voxel_cones/svo/pool.glsl"

// index + 1 of the static tile, or 0
layout(std430, set = 1, binding = 0) restrict readonly buffer Originals { uint originals[]; };
// 27 bits, x fastest
layout(std430, set = 1, binding = 1) restrict readonly buffer RemadeTexels {
    uint remade_texels[];
};
layout(set = 1, binding = 2, rgba16f) uniform restrict image3D bricks;

layout(push_constant) uniform KeepParams {
    uint first;           // first dynamic tile of the level
    uint count;           // its dynamic tiles
    uint first_dynamic;   // of all levels
} params;

void main() {
    uint thread = linear_group(gl_WorkGroupID) * 64u + gl_LocalInvocationIndex;
    uint index = thread / 27u, texel = thread % 27u;
    if (index >= params.count) return;
    uint tile = params.first + index, slot = dynamic_slot(tile, params.first_dynamic);
    if ((remade_texels[slot] >> texel & 1u) != 0u) return;
    ivec3 at = ivec3(texel % 3u, texel / 3u % 3u, texel / 9u), size = imageSize(bricks);
    uint original = originals[slot];
    vec4 value = vec4(0.0);
    if (original != 0u) value = imageLoad(bricks, brick_texel(original - 1u, size) + at);
    imageStore(bricks, brick_texel(tile, size) + at, value);
}
