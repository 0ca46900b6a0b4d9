// The box of cells that the rasterizations along an axis look at.
#ifndef LUMIVOX_LPV_BOX
#define LUMIVOX_LPV_BOX

#include "gi/lpv/grid.glsl"

layout(push_constant) uniform FacesParams {
    CellGrid grid;
    ivec4 low;    // xyz: the box's first cell in the grid; w: axis that is looked along: 0, 1, 2
    ivec4 size;   // xyz: cells of the box along each axis
} params;

// With the axis that is looked along last.
vec3 turned(vec3 v) {
    return params.low.w == 0 ? v.yzx : params.low.w == 1 ? v.zxy : v;
}

ivec3 turned(ivec3 v) {
    return params.low.w == 0 ? v.yzx : params.low.w == 1 ? v.zxy : v;
}

bool is_in_box(ivec3 cell) {
    ivec3 place = cell - params.low.xyz;
    return all(greaterThanEqual(place, ivec3(0))) && all(lessThan(place, params.size.xyz));
}

#endif
