// What voxel.bounce has in common, whether it gathers by cones or by rays: from where each side of
// a voxel looks, and in which directions.
#ifndef LUMIVOX_BOUNCE
#define LUMIVOX_BOUNCE

#include "shared/directions.glsl"
#include "gi/shared/voxel/grid.glsl"
#include "gi/shared/voxel/records.glsl"

const float GOLDEN_ANGLE = 2.399963229728653;

// Two numbers of [0, 1) for a voxel: one of the 64 patterns of a block, the points of a Hammersley
// set (as interleaved_offset has them for pixels).
vec2 voxel_pattern(uvec3 voxel) {
    uvec3 local = voxel & 3u;
    uint index = (local.x | local.y << 2 | local.z << 4) * 19u & 63u;
    float inverse = float(bitfieldReverse(index)) * 2.3283064365386963e-10;
    uvec3 block = voxel >> 2;
    uint turn = block.x * 0x9e3779b1u ^ block.y * 0x85ebca77u ^ block.z * 0xc2b2ae3du;
    turn = (turn ^ turn >> 15) * 0x2c1b3c6du;
    return vec2(
        (float(index) + 0.5) / 64.0, fract(inverse + float(turn >> 8) * (1.0 / 16777216.0)));
}

// Unit normal from which direction number `i` looks: of the given side or face; of a voxel that has
// one radiance for all, of its front, but of opposed surfaces from either side in turn.
vec3 looking_normal(Voxel voxel, uint sides, uint side, uint i) {
    if (sides == 6u) return normal_of_face(voxel, side);
    bool is_back = sides == 2u ? side == 1u : is_opposed(voxel) && (i & 1u) == 1u;
    vec3 front = front_of(voxel);
    return is_back ? -front : front;
}

#endif
