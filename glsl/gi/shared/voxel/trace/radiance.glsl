// What is seen of a space's voxels. The including file declares `voxel_radiance`, half floats, and
// SIDES.
#ifndef LUMIVOX_RADIANCE
#define LUMIVOX_RADIANCE

#include "gi/shared/voxel/light/merged.glsl"

uint sides_of_voxels() {
    return SIDES;
}

// The faces on the sides that a vector points to, and these radiances, weighted.
vec3 faces_towards(uint slot, vec3 to, vec3 weights) {
    vec3 sum = vec3(0.0);
    for (uint axis = 0u; axis < 3u; ++axis)
        sum += weights[axis] * side_of_voxel(6u * slot + 2u * axis + uint(to[axis] < 0.0)).rgb;
    return sum;
}

vec3 radiance_towards(uint slot, vec3 facing) {
    if (SIDES == 6u) return faces_towards(slot, facing, facing * facing);
    uint side = slot;
    if (SIDES == 2u) side = 2u * slot + uint(dot(facing, front_of(surface_of(slot))) < 0.0);
    return side_of_voxel(side).rgb;
}

vec3 radiance_along(uint slot, vec3 direction) {
    if (SIDES == 1u) return side_of_voxel(slot).rgb;
    Voxel voxel = surface_of(slot);
    if (SIDES == 2u) return side_of_voxel(2u * slot + uint(sees_back(voxel, direction))).rgb;
    vec3 n = unpack_mean_normal(voxel.normal);
    if (is_one_plane(n)) {
        n = normalize(n) * (dot(n, direction) > 0.0 ? -1.0 : 1.0);
        return faces_towards(slot, n, n * n);
    }
    vec3 areas = vec3(side_of_voxel(6u * slot).w, side_of_voxel(6u * slot + 2u).w,
        side_of_voxel(6u * slot + 4u).w);
    vec3 seen = areas * abs(direction);
    return faces_towards(slot, -direction, seen / max(seen.x + seen.y + seen.z, 1e-6));
}

#endif
