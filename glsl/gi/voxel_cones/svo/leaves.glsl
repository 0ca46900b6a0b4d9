// What the voxels of a leaf tile put into its brick.
//
// A voxel is one lattice point, and its own tile writes it; with CORNERS a lattice point is a
// corner of eight voxels, and a tile adds an eighth of each of its own. The rest comes by
// svo.transfer_borders. A thread a texel: of the 2³ first of a brick, or with CORNERS of all 3³.
#ifndef LUMIVOX_LEAVES
#define LUMIVOX_LEAVES

#include "gi/voxel_cones/svo/pool.glsl"
#include "gi/voxel_cones/svo/touched.glsl"

layout(constant_id = 0) const uint CORNERS = 0;
layout(constant_id = 2) const uint TOUCHED = 0;   // 1: of the touched tiles, 0: of all

// The including pass declares `nodes`, `bricks`, `touched_levels`, `touched_tiles` and `params`,
// and before it includes this
//   vec4 voxel_texel(uint voxel, uint face)      what a voxel puts there, premultiplied by opacity
//   uint brick_of(uint tile, uint face)          of a tile's index
//   bool is_of_piece(uint tile)                  whether what the voxels of a tile's word are made
//   of is bound

vec4 leaf(uint tile, uvec3 at, uint face) {
    uint node = child_index(at);
    return has_child(tile, node) ? voxel_texel(child_of(tile, node), face) : vec4(0.0);
}

void write_leaves(uint faces) {
    uint edge = 2u;
    if (CORNERS != 0u) edge = 3u;
    uint texels = edge * edge * edge;
    uint thread = linear_group(gl_WorkGroupID) * 64u + gl_LocalInvocationIndex;
    uint count =
        TOUCHED != 0u ? touched_levels[params.level].count : params.count + params.dynamic_count;
    if (thread >= texels * count) return;
    uint index = thread / texels, texel = thread % texels;
    uint brick = TOUCHED != 0u ? touched_tiles[index]
                               : nth_tile(index, params.first, params.count, params.first_dynamic),
         tile = nodes[brick];
    if (!is_of_piece(tile)) return;
    uvec3 at = uvec3(texel % edge, texel / edge % edge, texel / (edge * edge));
    ivec3 size = imageSize(bricks);
    for (uint face = 0u; face < faces; ++face) {
        vec4 value = vec4(0.0);
        if (CORNERS == 0u) {
            value = leaf(tile, at, face);
        } else {
            uvec3 low = uvec3(max(ivec3(at) - 1, 0)), high = min(at, uvec3(1u));
            for (uint z = low.z; z <= high.z; ++z) {
                for (uint y = low.y; y <= high.y; ++y) {
                    for (uint x = low.x; x <= high.x; ++x)
                        value += 0.125 * leaf(tile, uvec3(x, y, z), face);
                }
            }
        }
        imageStore(bricks, brick_texel(brick_of(brick, face), size) + ivec3(at), value);
    }
}

#endif
