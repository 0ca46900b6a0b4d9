#version 460
#extension GL_GOOGLE_include_directive : require
// lpv.faces: the face between two cells is opaque where the segment between their centres meets a
// triangle. A fragment is such a meeting: its pixel's centre is the row of the cells' centres.
#include "shared/frame.glsl"
#include "shared/material.glsl"
#include "gi/lpv/grid.glsl"

layout(std430, set = 1, binding = 0) restrict buffer Faces { uint faces[]; };

layout(push_constant) uniform FacesParams {
    CellGrid grid;
    uint axis;
} params;

layout(location = 0) in float depth;
layout(location = 1) in vec2 uv;
layout(location = 2) flat in uint material;

void main() {
    if (materials[material].albedo.w > 0.0
        && texture(sampler2D(mask_texture, linear_repeat), uv).r < 0.5)
        discard;
    ivec3 turned = ivec3(ivec2(gl_FragCoord.xy), int(floor(depth)));
    ivec3 cell = params.axis == 0u ? turned.zxy : params.axis == 1u ? turned.yzx : turned;
    ivec3 next = cell;
    next[params.axis] += 1;
    uint low_face = 1u << 2u * params.axis;
    if (is_inside(params.grid, cell))
        atomicOr(faces[cell_index(params.grid, cell)], low_face << 1u);
    if (is_inside(params.grid, next)) atomicOr(faces[cell_index(params.grid, next)], low_face);
}
