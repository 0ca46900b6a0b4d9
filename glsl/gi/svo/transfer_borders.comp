#version 460
#extension GL_GOOGLE_include_directive : require
// svo.transfer_borders: two bricks that share nine texels along an axis both get the sum of what each has (Crassin et al. 2011, figure 7, with both
// directions of an axis in one pass). After the three axes every copy of a texel is the same sum. A thread a texel pair.
layout(local_size_x = 64) in;

#include "gi/svo/pool.glsl"

layout(std430, set = 1, binding = 0) restrict readonly buffer Neighbours { uint neighbours[]; };
layout(set = 1, binding = 1, rgba16f) uniform restrict image3D bricks;

layout(push_constant) uniform TransferParams { uint first; uint count; uint axis; } params;

void main() {
    uint thread = linear_group(gl_WorkGroupID) * 64u + gl_LocalInvocationIndex;
    if (thread >= 9u * params.count) return;
    uint tile = params.first + thread / 9u, texel = thread % 9u;
    uint neighbour = neighbours[3u * tile + params.axis];
    if (neighbour == 0u) return;
    ivec3 size = imageSize(bricks), across = ivec3(0);
    across[(params.axis + 1u) % 3u] = int(texel % 3u);
    across[(params.axis + 2u) % 3u] = int(texel / 3u);
    ivec3 low = brick_texel(tile, size) + across, high = brick_texel(neighbour - 1u, size) + across;
    low[params.axis] += 2;
    vec4 sum = imageLoad(bricks, low) + imageLoad(bricks, high);
    imageStore(bricks, low, sum);
    imageStore(bricks, high, sum);
}
