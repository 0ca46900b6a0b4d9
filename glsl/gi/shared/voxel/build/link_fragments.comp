#version 460
#extension GL_GOOGLE_include_directive : require
// voxel.link_fragments: one linked list of fragments a voxel. The order within a list depends on
// the run; what is made of it does not.
layout(local_size_x = 64) in;

#include "gi/shared/voxel/grid.glsl"
#include "gi/shared/voxel/records.glsl"

layout(std430, set = 1, binding = 0) restrict readonly buffer Occupancy { uvec2 occupancy[]; };
layout(std430, set = 1, binding = 1) restrict readonly buffer BlockBases { uint block_bases[]; };
layout(std430, set = 1, binding = 2) restrict buffer Fragments { Fragment fragments[]; };
layout(std430, set = 1, binding = 3) restrict buffer Heads { uint heads[]; };

layout(push_constant) uniform LinkParams {
    uint resolution;
    uint fragment_count;
    uint first_fragment;
}
params;

void main() {
    uint index = gl_GlobalInvocationID.x + gl_GlobalInvocationID.y * 4194240u;
    if (index >= params.fragment_count) return;
    index += params.first_fragment;
    uvec2 place = fragments[index].place_area;
    uvec3 voxel = uvec3(voxel_coordinates(place.x, place.y));
    uint block = block_index(voxel, params.resolution);
    uint slot = block_bases[block] + set_bits_below(occupancy[block], block_bit(voxel));
    fragments[index].position_next.y = atomicExchange(heads[slot], index + 1u);
}
