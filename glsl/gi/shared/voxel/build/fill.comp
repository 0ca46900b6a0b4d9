#version 460
#extension GL_GOOGLE_include_directive : require
// voxel.fill: fragments of the voxels that lie inside of a body along all three axes, where nothing
// has touched them: black surface that looks all ways.
layout(local_size_x = 64) in;

#include "gi/shared/voxel/grid.glsl"
#include "gi/shared/voxel/records.glsl"
#include "gi/shared/voxel/build/inside.glsl"

layout(std430, set = 1, binding = 0) restrict buffer Occupancy { uint occupancy[]; };
layout(std430, set = 1, binding = 1) restrict writeonly buffer Fragments { Fragment fragments[]; };
layout(std430, set = 1, binding = 2) restrict writeonly buffer FragmentEmission {
    uvec2 fragment_emission[];
};
layout(std430, set = 1, binding = 3) restrict buffer Counters { uint fragment_count; };
layout(std430, set = 1, binding = 4) restrict readonly buffer Inside { uint inside[]; };

layout(constant_id = 0) const uint EMISSIVE = 0;   // 1: store emission

layout(push_constant) uniform FillParams {
    uint resolution;
    // first and last voxel that is asked for, 16 bits each, along x, y, z
    uint clip_x, clip_y, clip_z;
    uint capacity;   // fragments that fit; further ones are counted only
} params;

bool is_inside(uvec3 voxel, uint axis) {
    uvec2 column = uvec2(voxel[(axis + 1u) % 3u], voxel[(axis + 2u) % 3u]);
    uint along = voxel[axis];
    return (inside[word_of(axis, column, along, params.resolution)] >> (along & 31u) & 1u) != 0u;
}

// A face of a voxel's worth of surface along each axis.
void store(uvec3 voxel, vec3 normal, uint slot) {
    if (slot >= params.capacity) return;
    uint area = uint(AREA_UNIT * sqrt(3.0));
    fragments[slot].place_area = uvec2(voxel.x | voxel.y << 16, voxel.z | area << 16);
    fragments[slot].normal_albedo = uvec2(pack_unit(normal), 0u);
    fragments[slot].position_next.x = pack_unorm10(vec3(0.5));
    if (EMISSIVE != 0u) fragment_emission[slot] = uvec2(0u);
}

void main() {
    uvec3 low = uvec3(params.clip_x, params.clip_y, params.clip_z) & 0xffffu;
    uvec3 size = (uvec3(params.clip_x, params.clip_y, params.clip_z) >> 16) + 1u - low;
    uint index = gl_GlobalInvocationID.x + gl_GlobalInvocationID.y * 4194240u;
    if (index >= size.x * size.y * size.z) return;
    uvec3 voxel = low + uvec3(index % size.x, index / size.x % size.y, index / (size.x * size.y));
    if (!is_inside(voxel, 0u) || !is_inside(voxel, 1u) || !is_inside(voxel, 2u)) return;
    uint bit = block_bit(voxel);
    uint word = 2u * block_index(voxel, params.resolution) + (bit >> 5), own = 1u << (bit & 31u);
    if ((atomicOr(occupancy[word], own) & own) != 0u) return;
    uint slot = atomicAdd(fragment_count, 2u);
    vec3 diagonal = vec3(inversesqrt(3.0));
    store(voxel, diagonal, slot);
    store(voxel, -diagonal, slot + 1u);
}
