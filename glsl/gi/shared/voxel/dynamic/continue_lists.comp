#version 460
#extension GL_GOOGLE_include_directive : require
// voxel.continue_lists: the list of fragments of each voxel of a touched block starts as that of
// its static fragments, which dynamic ones are then put before: what is made of the list is made of
// both, and the static list stays as it is. 64 threads a touched block.
layout(local_size_x = 64) in;

#include "gi/shared/voxel/grid.glsl"
#include "gi/shared/voxel/dynamic/touched.glsl"

layout(std430, set = 1, binding = 0) restrict readonly buffer TouchedBlocks {
    TouchedBlock touched[];
};
layout(std430, set = 1, binding = 1) restrict readonly buffer Occupancy { uvec2 occupancy[]; };
layout(std430, set = 1, binding = 2) restrict readonly buffer BlockBases { uint block_bases[]; };
layout(std430, set = 1, binding = 3) restrict buffer Heads { uint heads[]; };

layout(push_constant) uniform ListParams { uint touched_count; } params;

void main() {
    uint index = gl_GlobalInvocationID.x + gl_GlobalInvocationID.y * 4194240u;
    if (index >= 64u * params.touched_count) return;
    TouchedBlock at = touched[index / 64u];
    uint bit = index % 64u;
    uvec2 all = occupancy[at.block], still = uvec2(at.static_low, at.static_high);
    if (!block_has(all, bit)) return;
    uint head = block_has(still, bit) ? heads[at.static_base + set_bits_below(still, bit)] : 0u;
    heads[block_bases[at.block] + set_bits_below(all, bit)] = head;
}
