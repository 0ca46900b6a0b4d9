// The grid of cells. The including pass declares push constants `params` with `grid` and `size`.
#ifndef LUMIVOX_LPV_GRID
#define LUMIVOX_LPV_GRID

struct CellGrid {
    vec4 place;   // xyz: corner of the lattice's cell (0, 0, 0) [m]; w: edge of a cell [m]
    ivec4 size;   // xyz: cells along each axis
    ivec4 first;  // xyz: the first cell in the lattice; w: first layer in the images of light
};

// A cell's word of faces. Bits 0 to 5: the opaque ones, in the order −x, +x, −y, +y, −z, +z. Bits
// from 8: the place of the first of them in the list of sides; a side is a face as its cell sees
// it.
const uint FACE_BITS = 63u;
const uint FIRST_SIDE_SHIFT = 8u;

uint side_of(uint word, uint face) {
    return (word >> FIRST_SIDE_SHIFT) + uint(bitCount(word & ((1u << face) - 1u)));
}

int cell_index(CellGrid grid, ivec3 cell) {
    return cell.x + grid.size.x * (cell.y + grid.size.y * cell.z);
}

ivec3 cell_at(CellGrid grid, int index) {
    ivec3 size = grid.size.xyz;
    return ivec3(index % size.x, index / size.x % size.y, index / (size.x * size.y));
}

bool is_inside(CellGrid grid, ivec3 cell) {
    return all(greaterThanEqual(cell, ivec3(0))) && all(lessThan(cell, grid.size.xyz));
}

// Where a position is in the lattice [cells].
vec3 to_lattice(CellGrid grid, vec3 position_ws) {
    return (position_ws - grid.place.xyz) / grid.place.w;
}

// Where a position is in the grid [cells].
vec3 to_cells(CellGrid grid, vec3 position_ws) {
    return to_lattice(grid, position_ws) - vec3(grid.first.xyz);
}

// Moves a position [cells] off its surface, so far along the normal that a whole number of shifts
// takes the centre of the cell there to the surface's front, however oblique it is.
vec3 shifted(vec3 position, vec3 normal, float shift) {
    vec3 m = abs(normal);
    return position + shift * (m.x + m.y + m.z) * normal;
}

#endif
