// What probes see of voxels. The including pass declares SPACE_BINDING, SPACE_CONSTANT and `params`
// with the `grid` and its `resolution`.
#ifndef LUMIVOX_PROBES_VOXELS
#define LUMIVOX_PROBES_VOXELS

#include "gi/shared/voxel/trace/lit_grid.glsl"
#include "gi/shared/voxel/trace/trace.glsl"

// The first voxel that a ray hits.
struct VoxelHit {
    int slot;         // −1: none
    float distance;   // to the voxel's surface [m]; infinite where there is none
};

// Ray number `ray` from a place [m] in the air, of a probe that `seed` tells from others.
VoxelHit voxel_along(vec3 place, vec3 direction, uint seed, uint ray) {
    vec3 origin = (place - params.grid.xyz) / params.grid.w;
    // Nothing is the probe itself.
    TraceSettings settings = TraceSettings(params.resolution, -1.0, 0.0, seed, ray);
    float entry;
    int slot = trace(origin, direction, vec3(0.0), vec3(0.0), settings, entry);
    if (slot < 0) return VoxelHit(-1, uintBitsToFloat(0x7f800000u));
    Voxel voxel = surface_of(uint(slot));
    vec3 normal = unpack_mean_normal(voxel.normal);
    float rate = dot(normal, direction), reach = entry + 0.5;
    if (is_one_plane(normal) && abs(rate) > 1e-3) {
        vec3 surface = voxel_coordinates(voxel.xy, voxel.z_area)
            + unpack_unorm10(voxel.mean_position);
        // Within the voxel, and a little beside it, as rays hit planes.
        reach = clamp(dot(normal, surface - origin) / rate, entry, entry + 2.0);
    }
    return VoxelHit(slot, reach * params.grid.w);
}

#endif
