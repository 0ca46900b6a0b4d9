#version 460
#extension GL_GOOGLE_include_directive : require
// voxel.restore_blocks: touched blocks become again what they are without dynamic geometry. A
// thread a touched block.
layout(local_size_x = 64) in;

#include "gi/shared/voxel/dynamic/touched.glsl"

layout(std430, set = 1, binding = 0) restrict readonly buffer TouchedBlocks {
    TouchedBlock touched[];
};
layout(std430, set = 1, binding = 1) restrict writeonly buffer Occupancy { uvec2 occupancy[]; };
layout(std430, set = 1, binding = 2) restrict writeonly buffer BlockBases { uint block_bases[]; };
layout(std430, set = 1, binding = 3) restrict writeonly buffer DynamicOccupancy {
    uvec2 dynamic_occupancy[];
};

layout(push_constant) uniform RestoreParams { uint touched_count; } params;

void main() {
    uint index = gl_GlobalInvocationID.x + gl_GlobalInvocationID.y * 4194240u;
    if (index >= params.touched_count) return;
    TouchedBlock before = touched[index];
    occupancy[before.block] = uvec2(before.static_low, before.static_high);
    block_bases[before.block] = before.static_base;
    dynamic_occupancy[before.block] = uvec2(0u);
}
