#version 460
#extension GL_GOOGLE_include_directive : require
// lpv.faces: the face between two cells is opaque where the segment between their centres meets a
// triangle.
#include "gi/lpv/crossing.glsl"

layout(std430, set = 1, binding = 0) restrict buffer Faces { uint faces[]; };

void main() {
    Crossing crossing = find_crossing();
    uint high_side = 1u << 2 * params.low.w;
    if (is_in_box(crossing.low))
        atomicOr(faces[cell_index(params.grid, crossing.low)], high_side << 1u);
    if (is_in_box(crossing.high))
        atomicOr(faces[cell_index(params.grid, crossing.high)], high_side);
}
