// Light of voxels where something else says what is hit.
#ifndef LUMIVOX_HIT
#define LUMIVOX_HIT

#include "gi/shared/voxel/trace/space.glsl"

// Number of the voxel at a place, or −1.
int slot_at(vec3 place) {
    bool is_inside =
        all(greaterThanEqual(place, vec3(0.0))) && all(lessThan(place, vec3(params.resolution)));
    int slot = -1;
    if (is_inside) slot = cell_around(ivec3(place)).slot;
    return slot;
}

// Radiance of a surface at a place, whose unit normal faces the viewer: of the voxel there, on that
// side. A place on a voxel's border is in the neighbour by rounding; a voxel of a thin surface is
// up to half a voxel off.
vec3 radiance_at(vec3 place, vec3 facing) {
    float edge = voxel_edge(place);
    int slot = slot_at(place);
    if (slot < 0) slot = slot_at(place - 0.05 * edge * facing);
    if (slot < 0) slot = slot_at(place + 0.05 * edge * facing);
    if (slot < 0) slot = slot_at(place - 0.5 * edge * facing);
    if (slot < 0) slot = slot_at(place + 0.5 * edge * facing);
    if (slot < 0) return vec3(0.0);
    return radiance_towards(uint(slot), facing);
}

#endif
