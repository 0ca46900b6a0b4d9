// A fragment of the rasterizations along an axis: where the segment between the centres of two
// cells meets a triangle.
#ifndef LUMIVOX_LPV_CROSSING
#define LUMIVOX_LPV_CROSSING

#include "shared/frame.glsl"
#include "shared/material.glsl"
#include "gi/lpv/grid.glsl"

layout(push_constant) uniform FacesParams {
    CellGrid grid;
    uint axis;
} params;

layout(location = 0) in float depth;
layout(location = 1) in vec2 uv;
layout(location = 2) flat in uint triangle_index;
layout(location = 3) flat in vec3 normal;

// The two cells, and the one's share of the segment.
struct Crossing {
    ivec3 low, high;
    float share;
};

// Leaves fragments in holes of a mask.
Crossing find_crossing() {
    if (materials[triangles[triangle_index].w].albedo.w > 0.0
        && texture(sampler2D(mask_texture, linear_repeat), uv).r < 0.5)
        discard;
    ivec3 turned = ivec3(ivec2(gl_FragCoord.xy), int(floor(depth)));
    ivec3 low = params.axis == 0u ? turned.zxy : params.axis == 1u ? turned.yzx : turned;
    ivec3 high = low;
    high[params.axis] += 1;
    return Crossing(low, high, depth - floor(depth));
}

#endif
