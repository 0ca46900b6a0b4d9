#version 460
#extension GL_GOOGLE_include_directive : require
// lpv.shift_faces: opaque faces of the cells that stay in a grid that has moved.
layout(local_size_x = 64) in;

#include "gi/lpv/grid.glsl"

layout(std430, set = 1, binding = 0) restrict readonly buffer OldFaces { uint old_faces[]; };
layout(std430, set = 1, binding = 1) restrict writeonly buffer Faces { uint faces[]; };

layout(push_constant) uniform ShiftParams {
    CellGrid grid;
    ivec4 shift;   // xyz: cells that the grid has moved by
} params;

void main() {
    int index = int(gl_GlobalInvocationID.x);
    ivec3 size = params.grid.size.xyz;
    if (index >= size.x * size.y * size.z) return;
    ivec3 before = cell_at(params.grid, index) + params.shift.xyz;
    uint word = 0u;
    if (is_inside(params.grid, before))
        word = old_faces[cell_index(params.grid, before)] & FACE_BITS;
    faces[index] = word;
}
