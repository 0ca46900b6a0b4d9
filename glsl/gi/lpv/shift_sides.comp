#version 460
#extension GL_GOOGLE_include_directive : require
// lpv.shift_sides: sides of the cells that stay in a grid that has moved, to their new places in
// the list.
layout(local_size_x = 64) in;

#include "gi/lpv/grid.glsl"
#include "gi/lpv/sides.glsl"

layout(std430, set = 1, binding = 0) restrict readonly buffer OldFaces { uint old_faces[]; };
layout(std430, set = 1, binding = 1) restrict readonly buffer Faces { uint faces[]; };
layout(std430, set = 1, binding = 2) restrict readonly buffer OldSides { Side old_sides[]; };
layout(std430, set = 1, binding = 3) restrict writeonly buffer Sides { Side sides[]; };

layout(push_constant) uniform ShiftParams {
    CellGrid grid;
    ivec4 shift;   // xyz: cells that the grid has moved by
} params;

void main() {
    int index = int(gl_GlobalInvocationID.x);
    ivec3 size = params.grid.size.xyz;
    if (index >= size.x * size.y * size.z) return;
    ivec3 before = cell_at(params.grid, index) + params.shift.xyz;
    if (!is_inside(params.grid, before)) return;
    uint old_word = old_faces[cell_index(params.grid, before)];
    uint count = uint(bitCount(old_word & FACE_BITS));
    uint from = old_word >> FIRST_SIDE_SHIFT, to = faces[index] >> FIRST_SIDE_SHIFT;
    for (uint i = 0u; i < count; ++i) {
        Side side = old_sides[from + i];
        side.place.w = intBitsToFloat(index);
        sides[to + i] = side;
    }
}
