#version 460
#extension GL_GOOGLE_include_directive : require
// lpv.nearest: which surface each cell sees of its opaque faces.
#include "gi/lpv/crossing.glsl"
#include "gi/lpv/sides.glsl"

layout(std430, set = 1, binding = 0) restrict readonly buffer Faces { uint faces[]; };
layout(std430, set = 1, binding = 1) restrict buffer Nearest { uint nearest[]; };

void note(ivec3 cell, uint face, float distance) {
    if (!is_in_box(cell)) return;
    uint side = side_of(faces[cell_index(params.grid, cell)], face);
    atomicMin(nearest[side], nearness(distance, triangle_index));
}

void main() {
    Crossing crossing = find_crossing();
    uint face = 2u * uint(params.low.w);
    note(crossing.low, face + 1u, crossing.share);
    note(crossing.high, face, 1.0 - crossing.share);
}
