#version 460
#extension GL_GOOGLE_include_directive : require
// svo.index_tiles: the tiles of a level in the indirection texture, by the words of the level
// above. Where there are none, it is 0 already. A thread a place of the level above.
layout(local_size_x = 64) in;

#include "gi/voxel_cones/svo/indirection.glsl"
#include "gi/voxel_cones/svo/pool.glsl"

layout(std430, set = 1, binding = 0) restrict readonly buffer Nodes { uint nodes[]; };
layout(set = 1, binding = 1, rg32ui) uniform restrict uimage3D indirection;

layout(push_constant) uniform IndexTilesParams {
    int level;   // the root's: tile 0 alone
    int root;
} params;

void main() {
    int index = int(linear_group(gl_WorkGroupID) * 64u + gl_LocalInvocationIndex),
        level = params.level, root = params.root;
    if (level == root) {
        if (index == 0)
            imageStore(indirection, indirection_texel(ivec3(0), root, root),
                uvec4(1u, nodes[0], 0u, 0u));
        return;
    }
    int bits = root - level - 1, last = (1 << bits) - 1;
    if (index >= 1 << 3 * bits) return;
    ivec3 place = ivec3(index & last, index >> bits & last, index >> 2 * bits);
    uvec2 above = imageLoad(indirection, indirection_texel(place, level + 1, root)).xy;
    if (above.x == 0u) return;
    for (uint node = 0u; node < 8u; ++node) {
        if (!has_child(above.y, node)) continue;
        uint tile = child_of(above.y, node);
        imageStore(indirection,
            indirection_texel(2 * place + ivec3(child_offset(node)), level, root),
            uvec4(tile + 1u, nodes[tile], 0u, 0u));
    }
}
