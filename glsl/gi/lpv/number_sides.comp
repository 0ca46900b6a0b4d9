#version 460
#extension GL_GOOGLE_include_directive : require
// lpv.number_sides: a place in the list of sides for each opaque face of each cell.
layout(local_size_x = 64) in;

#include "gi/lpv/grid.glsl"

layout(std430, set = 1, binding = 0) restrict buffer Faces { uint faces[]; };
layout(std430, set = 1, binding = 1) restrict buffer SideCount { uint side_count; };

layout(push_constant) uniform NumberParams { uint cell_count; } params;

void main() {
    uint cell = gl_GlobalInvocationID.x;
    if (cell >= params.cell_count || faces[cell] == 0u) return;
    uint first = atomicAdd(side_count, uint(bitCount(faces[cell] & FACE_BITS)));
    faces[cell] |= first << FIRST_SIDE_SHIFT;
}
