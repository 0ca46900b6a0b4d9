#version 460
#extension GL_GOOGLE_include_directive : require
// voxel.inject_rsm where voxels are found by descent from the octree's root (Crassin et al. 2011,
// section 6).
#include "gi/shared/voxel/light/inject.glsl"
#include "gi/voxel_cones/svo/pool.glsl"

layout(std430, set = 1, binding = 8) restrict readonly buffer Nodes { uint nodes[]; };

// Tile of 8³ voxels that the last descent came through: the next starts there if it can.
uint last_tile = 0u;
uvec3 last_place = uvec3(0xffffffffu);

int voxel_at(vec3 position) {
    if (any(lessThan(position, vec3(0.0)))
        || any(greaterThanEqual(position, vec3(params.resolution))))
        return -1;
    uvec3 voxel = uvec3(position);
    bool is_near = voxel >> 3 == last_place;
    uint child = is_near ? last_tile : 0u;
    for (int above = is_near ? 2 : findMSB(params.resolution) - 1; above >= 0; --above) {
        if (above == 2) {
            last_tile = child;
            last_place = voxel >> 3;
        }
        uint tile = nodes[child], node = child_index(voxel >> above);
        if (!has_child(tile, node)) return -1;
        child = child_of(tile, node);
    }
    return int(child);
}
