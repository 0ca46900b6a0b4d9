#version 460
#extension GL_GOOGLE_include_directive : require
// svo.write_leaves: what the voxels of a leaf tile put into its brick: radiance premultiplied by opacity.
//
// A voxel is one lattice point, and its own tile writes it; with CORNERS a lattice point is a corner of eight voxels, and a tile adds an eighth of each
// of its own. The rest comes by svo.transfer_borders. A thread a texel: of the 2³ first of a brick, or with CORNERS of all 3³.
layout(local_size_x = 64) in;

#include "gi/svo/pool.glsl"
#include "gi/svo/touched.glsl"

layout(constant_id = 0) const uint CORNERS = 0;
layout(constant_id = 1) const uint TOUCHED = 0;   // 1: of the touched tiles, 0: of all

layout(std430, set = 1, binding = 0) restrict readonly buffer Nodes { uint nodes[]; };
layout(std430, set = 1, binding = 1) restrict readonly buffer VoxelRadiance { uvec2 voxel_radiance[]; };
layout(set = 1, binding = 2, rgba16f) uniform restrict writeonly image3D bricks;

layout(std430, set = 1, binding = 3) restrict readonly buffer TouchedLevels { Touched touched_levels[]; };
layout(std430, set = 1, binding = 4) restrict readonly buffer TouchedTiles { uint touched_tiles[]; };

layout(push_constant) uniform BrickParams { uint first; uint count; uint first_dynamic; uint dynamic_count; uint level; } params;

vec4 leaf(uint tile, uvec3 at) {
    uint node = child_index(at);
    if (!has_child(tile, node)) return vec4(0.0);
    uvec2 packed = voxel_radiance[child_of(tile, node)];
    vec2 blue_opacity = unpackHalf2x16(packed.y);
    return vec4(vec3(unpackHalf2x16(packed.x), blue_opacity.x) * blue_opacity.y, blue_opacity.y);
}

void main() {
    uint edge = 2u;
    if (CORNERS != 0u) edge = 3u;
    uint texels = edge * edge * edge;
    uint thread = linear_group(gl_WorkGroupID) * 64u + gl_LocalInvocationIndex;
    uint count = TOUCHED != 0u ? touched_levels[params.level].count : params.count + params.dynamic_count;
    if (thread >= texels * count) return;
    uint index = thread / texels, texel = thread % texels;
    uint brick = TOUCHED != 0u ? touched_tiles[index] : nth_tile(index, params.first, params.count, params.first_dynamic), tile = nodes[brick];
    uvec3 at = uvec3(texel % edge, texel / edge % edge, texel / (edge * edge));
    vec4 value = vec4(0.0);
    if (CORNERS == 0u) {
        value = leaf(tile, at);
    } else {
        uvec3 low = uvec3(max(ivec3(at) - 1, 0)), high = min(at, uvec3(1u));
        for (uint z = low.z; z <= high.z; ++z) {
            for (uint y = low.y; y <= high.y; ++y) {
                for (uint x = low.x; x <= high.x; ++x) value += 0.125 * leaf(tile, uvec3(x, y, z));
            }
        }
    }
    imageStore(bricks, brick_texel(brick, imageSize(bricks)) + ivec3(at), value);
}
