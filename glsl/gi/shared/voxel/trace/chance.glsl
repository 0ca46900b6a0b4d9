// Numbers of [0, 1) by which rays pass through voxels or stop in them.
#ifndef LUMIVOX_CHANCE
#define LUMIVOX_CHANCE

// PCG hash (Jarzynski & Olano 2020).
uint scrambled(uint number) {
    uint state = number * 747796405u + 2891336453u;
    uint word = (state >> (state >> 28) + 4u ^ state) * 277803737u;
    return word >> 22 ^ word;
}

// What tells a receiver from others: the pixel or voxel that it is, and the frame or side.
uint seed_of(uvec3 place, uint number) {
    return scrambled((place.x | place.y << 11 | place.z << 22) ^ scrambled(number));
}

// Of ray number `ray` of a receiver at a voxel. Those of its rays are golden ratios apart.
float chance(uvec3 voxel, uint seed, uint ray) {
    return float(seed_of(voxel, seed) + ray * 0x9e3779b9u >> 8) / 16777216.0;
}

#endif
