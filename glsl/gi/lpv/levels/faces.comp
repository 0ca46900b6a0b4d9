#version 460
#extension GL_GOOGLE_include_directive : require
// lpv.level_faces: opaque faces of the next level. A segment between two of its centres crosses a
// fine face in the middle, and has one at either end; the lower of the two is its own. A face is
// opaque where any of its four columns is.
layout(local_size_x = 8, local_size_y = 8) in;

#include "gi/lpv/grid.glsl"

layout(std430, set = 1, binding = 0) restrict readonly buffer FineFaces { uint fine_faces[]; };
layout(std430, set = 1, binding = 1) restrict writeonly buffer Faces { uint faces[]; };

layout(push_constant) uniform LevelParams {
    CellGrid fine;
    CellGrid coarse;
} params;

bool is_opaque(ivec3 cell, uint face) {
    return is_inside(params.fine, cell)
        && (fine_faces[cell_index(params.fine, cell)] >> face & 1u) != 0u;
}

// Whether light is stopped on its way from a cell to the next along an axis.
bool is_blocked(ivec3 cell, int axis) {
    for (int column = 0; column < 4; ++column) {
        ivec3 low = 2 * cell;
        low[(axis + 1) % 3] += column & 1;
        low[(axis + 2) % 3] += column >> 1;
        ivec3 next = low;
        next[axis] += 1;
        uint face = uint(2 * axis + 1);
        if (is_opaque(low, face) || is_opaque(next, face)) return true;
    }
    return false;
}

// Whether light is stopped between the border below the first cell along an axis and this cell.
bool is_border_blocked(ivec3 cell, int axis) {
    for (int column = 0; column < 4; ++column) {
        ivec3 low = 2 * cell;
        low[(axis + 1) % 3] += column & 1;
        low[(axis + 2) % 3] += column >> 1;
        if (is_opaque(low, uint(2 * axis))) return true;
    }
    return false;
}

void main() {
    ivec3 cell = ivec3(gl_GlobalInvocationID);
    if (!is_inside(params.coarse, cell)) return;
    uint word = 0u;
    for (int axis = 0; axis < 3; ++axis) {
        ivec3 before = cell;
        before[axis] -= 1;
        bool is_low =
            before[axis] < 0 ? is_border_blocked(cell, axis) : is_blocked(before, axis);
        word |= uint(is_low) << (2 * axis) | uint(is_blocked(cell, axis)) << (2 * axis + 1);
    }
    faces[cell_index(params.coarse, cell)] = word;
}
