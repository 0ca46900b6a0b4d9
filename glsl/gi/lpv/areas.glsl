// Surfels as what blocks light: each adds A and A n to the nearest corner of a cell. Sums are
// integers, the same in every run. The including pass declares `areas`, and push constants `params`
// with `grid` and `area_unit`.
#ifndef LUMIVOX_LPV_AREAS
#define LUMIVOX_LPV_AREAS

#include "gi/lpv/block.glsl"

struct Surfel {
    bool is_there;
    vec3 position;   // [m]
    vec3 normal;     // unit, towards what sees it
    float area;      // [m²]
};

// Surfels at one corner.
struct Areas {
    int node;   // −1: none
    vec4 sum;   // x, y, z of A n, then A [m²]
};

// A surfel counts as so many faces of a cell at most: at a grazing angle its area has no bound.
const float MOST_FACES = 16.0;

void add(Areas found) {
    if (found.node < 0) return;
    ivec4 steps = ivec4(round(found.sum / params.area_unit));
    for (int i = 0; i < 4; ++i)
        if (steps[i] != 0) atomicAdd(areas[4 * found.node + i], steps[i]);
}

// Adds a surfel to those at the same corner; at another, these are done.
void collect(inout Areas found, Surfel surfel) {
    CellGrid nodes = params.grid;
    nodes.size.xyz += 1;
    int node = -1;
    if (surfel.is_there) {
        ivec3 place = ivec3(floor(to_cells(params.grid, surfel.position) + 0.5));
        if (is_inside(nodes, place)) node = cell_index(nodes, place);
    }
    if (node != found.node) {
        add(found);
        found = Areas(node, vec4(0.0));
    }
    float most = MOST_FACES * params.grid.place.w * params.grid.place.w;
    if (node >= 0) found.sum += min(surfel.area, most) * vec4(surfel.normal, 1.0);
}

#endif
