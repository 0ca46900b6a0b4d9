#version 460
#extension GL_GOOGLE_include_directive : require
// svo.filter: the bricks of a level from their tiles' child bricks.
//
// Lattice point q of a level is the cube of 2³ finer points from 2q on, filtered to one texel. With
// CORNERS it is the mean over the eight cubes that meet at 2q: with the box filter the 27-tap
// Gaussian (¼, ½, ¼)³ of Crassin et al. 2011. A tile adds the cubes inside it: then eight for the
// brick's centre, four for the middle of a face, two for that of an edge, one for a corner; the
// rest comes by svo.transfer_borders. A thread a texel: of the 2³ first of a brick, or with CORNERS
// of all 3³.
layout(local_size_x = 64) in;

#include "gi/voxel_cones/svo/pool.glsl"
#include "gi/voxel_cones/svo/touched.glsl"
#include "gi/shared/voxel/prefilter.glsl"

layout(constant_id = 0) const uint FILTER = 1;
layout(constant_id = 1) const uint CORNERS = 0;
// 0 all texels, 1 the centre, 2 faces and edges, 3 corners
layout(constant_id = 2) const uint PART = 0;
layout(constant_id = 3) const uint FACES = 1;   // bricks of a tile: 1, or 6, one a face
layout(constant_id = 4) const uint TOUCHED = 0; // 1: of the touched tiles, 0: of all

layout(std430, set = 1, binding = 0) restrict readonly buffer Nodes { uint nodes[]; };
layout(set = 1, binding = 1, rgba16f) uniform restrict image3D bricks;

layout(std430, set = 1, binding = 2) restrict readonly buffer TouchedLevels {
    Touched touched_levels[];
};
layout(std430, set = 1, binding = 3) restrict readonly buffer TouchedTiles {
    uint touched_tiles[];
};

layout(push_constant) uniform BrickParams {
    uint first;            // static tile of the level
    uint count;
    uint first_dynamic;
    uint dynamic_count;
    uint level;
    uint shift;            // bricks from a tile's index to that of its first brick
    uint stride;           // from a face to the next
    uint child_shift;      // likewise on the next finer level
    uint child_stride;
} params;

uint texels_of_part() {
    uint count = 27u;
    if (CORNERS == 0u) count = 8u;
    if (PART == 1u) count = 1u;
    if (PART == 2u) count = 18u;
    if (PART == 3u) count = 8u;
    return count;
}

// The texel of the brick that is number `index` of the part.
uvec3 texel_of_part(uint index) {
    if (CORNERS == 0u) return child_offset(index);
    if (PART == 1u) return uvec3(1u);
    if (PART == 3u) return 2u * child_offset(index);
    uint texel = index;
    if (PART == 2u) {
        // One or two of their coordinates are 1.
        const uint TEXELS[18] = uint[](
            1u, 3u, 4u, 5u, 7u, 9u, 10u, 11u, 12u, 14u, 15u, 16u, 17u, 19u, 21u, 22u, 23u, 25u);
        texel = TEXELS[index];
    }
    return uvec3(texel % 3u, texel / 3u % 3u, texel / 9u);
}

// One of the 4³ cubes of finer texels inside a tile.
vec4 filtered_cube(uint tile, uvec3 cube, uint face, ivec3 size) {
    uint node = child_index(cube >> 1);
    vec4 result = vec4(0.0);
    if (has_child(tile, node)) {
        ivec3 corner =
            brick_texel(
                child_of(tile, node) + params.child_shift + face * params.child_stride, size)
            + ivec3(cube & 1u);
        vec4 c[8];
        for (int i = 0; i < 8; ++i)
            c[i] = imageLoad(bricks,
                corner
                    + (FACES == 6u ? face_child(i, int(face)) : ivec3(i & 1, i >> 1 & 1, i >> 2)));
        if (FACES == 6u) {
            result = filter_face(c);
        } else {
            result = filter_eight(c, FILTER);
        }
    }
    return result;
}

void main() {
    uint thread = linear_group(gl_WorkGroupID) * 64u + gl_LocalInvocationIndex;
    uint count = TOUCHED != 0u ? touched_levels[params.level].count
                               : params.count + params.dynamic_count,
         index = thread / texels_of_part();
    if (index >= count) return;
    uint brick = TOUCHED != 0u ? touched_tiles[index]
                               : nth_tile(index, params.first, params.count, params.first_dynamic),
         tile = nodes[brick];
    uvec3 at = texel_of_part(thread % texels_of_part());
    ivec3 size = imageSize(bricks);
    for (uint face = 0u; face < FACES; ++face) {
        vec4 sum = vec4(0.0);
        if (CORNERS == 0u) {
            sum = filtered_cube(tile, 2u * at, face, size);
        } else {
            // Cubes are numbered 0 to 3 along an axis: 0 and 1 in the lower child.
            uvec3 low = uvec3(max(2 * ivec3(at) - 1, 0)), high = min(2u * at, uvec3(3u));
            for (uint z = low.z; z <= high.z; ++z) {
                for (uint y = low.y; y <= high.y; ++y) {
                    for (uint x = low.x; x <= high.x; ++x)
                        sum += 0.125 * filtered_cube(tile, uvec3(x, y, z), face, size);
                }
            }
        }
        imageStore(bricks,
            brick_texel(brick + params.shift + face * params.stride, size) + ivec3(at), sum);
    }
}
