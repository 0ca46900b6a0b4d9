// Radiances of a space's voxels, half floats. The including file declares `voxel_radiance`, a word
// pair a side, and SIDES.
#ifndef LUMIVOX_RADIANCE
#define LUMIVOX_RADIANCE

uint sides_of_voxels() {
    return SIDES;
}

vec3 radiance_of(uint side) {
    uvec2 packed = voxel_radiance[side];
    return vec3(unpackHalf2x16(packed.x), unpackHalf2x16(packed.y).x);
}

#endif
