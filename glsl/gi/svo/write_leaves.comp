#version 460
#extension GL_GOOGLE_include_directive : require
// svo.write_leaves: what the voxels of a leaf tile put into its brick: radiance premultiplied by opacity; of voxels with two radiances, of both sides
// together. With NORMALS svo.write_normals: the mean normal of what shines, times its luminance (gi/svo/lit_normals.glsl) and opacity, and opacity.
//
// A voxel is one lattice point, and its own tile writes it; with CORNERS a lattice point is a corner of eight voxels, and a tile adds an eighth of each
// of its own. The rest comes by svo.transfer_borders. A thread a texel: of the 2³ first of a brick, or with CORNERS of all 3³.
layout(local_size_x = 64) in;

#include "gi/svo/pool.glsl"
#include "gi/svo/touched.glsl"
#ifdef NORMALS
#include "gi/svo/lit_normals.glsl"
#include "gi/voxel/records.glsl"
#endif

layout(constant_id = 0) const uint CORNERS = 0;
layout(constant_id = 1) const uint SIDES = 1;     // radiances of a voxel: 1, 2, or 6, one a face, and then as many bricks of a tile
layout(constant_id = 2) const uint TOUCHED = 0;   // 1: of the touched tiles, 0: of all

const float LARGEST_HALF = 65504.0;

layout(std430, set = 1, binding = 0) restrict readonly buffer Nodes { uint nodes[]; };
layout(std430, set = 1, binding = 1) restrict readonly buffer VoxelRadiance { uvec2 voxel_radiance[]; };
layout(set = 1, binding = 2, rgba16f) uniform restrict writeonly image3D bricks;

#ifdef NORMALS
layout(std430, set = 1, binding = 3) restrict readonly buffer VoxelRecords { Voxel voxel_records[]; };   // of a piece of the grid
const int LISTS = 4;
#else
const int LISTS = 3;
#endif

layout(std430, set = 1, binding = LISTS) restrict readonly buffer TouchedLevels { Touched touched_levels[]; };
layout(std430, set = 1, binding = LISTS + 1) restrict readonly buffer TouchedTiles { uint touched_tiles[]; };

#ifdef NORMALS
layout(push_constant) uniform NormalParams {
    uint first;         // tile of the level
    uint count;
    uint first_dynamic;
    uint dynamic_count;
    uint level;
    uint first_voxel;   // of the piece
    uint voxel_count;
} params;
#else
layout(push_constant) uniform BrickParams {
    uint first;            // static tile of the level
    uint count;
    uint first_dynamic;
    uint dynamic_count;
    uint level;
    uint shift;            // bricks from a tile's index to that of its first brick
    uint stride;           // from a face to the next
    uint child_shift;
    uint child_stride;
} params;
#endif

// Radiance and opacity.
vec4 side_of_voxel(uint side) {
    uvec2 packed = voxel_radiance[side];
    return vec4(unpackHalf2x16(packed.x), unpackHalf2x16(packed.y));
}

#ifdef NORMALS
vec4 voxel_texel(uint voxel, uint face) {
    vec4 front = side_of_voxel(2u * voxel), back = side_of_voxel(2u * voxel + 1u);
    Voxel record = voxel_records[voxel - params.first_voxel];
    vec3 normal = is_opposed(record) ? front_of(record) : unpack_mean_normal(record.normal);
    return vec4(luminance(front.rgb - back.rgb) * front.a * normal, front.a);
}

uint brick_of(uint tile, uint face) {
    return tile;
}

// The voxels of a tile lie in one block, and so in one piece; one without voxels is of all.
bool is_of_piece(uint tile) {
    return (tile & 255u) == 0u || (tile >> 8) - params.first_voxel < params.voxel_count;   // also below 0
}
#else
vec4 voxel_texel(uint voxel, uint face) {
    vec4 light = side_of_voxel(SIDES * voxel + face);
    if (SIDES == 2u) light.rgb = min(light.rgb + side_of_voxel(2u * voxel + 1u).rgb, vec3(LARGEST_HALF));
    return vec4(light.rgb * light.a, light.a);
}

uint brick_of(uint tile, uint face) {
    return tile + params.shift + face * params.stride;
}

bool is_of_piece(uint tile) {
    return true;
}
#endif

vec4 leaf(uint tile, uvec3 at, uint face) {
    uint node = child_index(at);
    return has_child(tile, node) ? voxel_texel(child_of(tile, node), face) : vec4(0.0);
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
    if (!is_of_piece(tile)) return;
    uvec3 at = uvec3(texel % edge, texel / edge % edge, texel / (edge * edge));
    ivec3 size = imageSize(bricks);
    uint faces = 1u;
    if (SIDES == 6u) faces = 6u;
    for (uint face = 0u; face < faces; ++face) {
        vec4 value = vec4(0.0);
        if (CORNERS == 0u) {
            value = leaf(tile, at, face);
        } else {
            uvec3 low = uvec3(max(ivec3(at) - 1, 0)), high = min(at, uvec3(1u));
            for (uint z = low.z; z <= high.z; ++z) {
                for (uint y = low.y; y <= high.y; ++y) {
                    for (uint x = low.x; x <= high.x; ++x) value += 0.125 * leaf(tile, uvec3(x, y, z), face);
                }
            }
        }
        imageStore(bricks, brick_texel(brick_of(brick, face), size) + ivec3(at), value);
    }
}
