#version 460
#extension GL_GOOGLE_include_directive : require
// lpv.merge_levels: what all coarser levels together have, into a level.
//
// As published a cell takes it where it has no light itself (Olovsson 2012, eq. 10): once all
// levels are merged, coarse ones first, the finest level that has light wins. That is the index
// volume, read off the light. Repaired, levels add up.
layout(local_size_x = 8, local_size_y = 8) in;

#include "gi/lpv/lobes.glsl"

layout(constant_id = 0) const bool FINEST = true;   // as published

layout(set = 1, binding = 0, rgba32f) uniform restrict readonly image3D coarse_sum;
layout(set = 1, binding = 1, rgba32f) uniform restrict image3D sum;

layout(push_constant) uniform LevelParams {
    CellGrid fine;
    CellGrid coarse;
} params;

void main() {
    ivec3 cell = ivec3(gl_GlobalInvocationID);
    if (!is_inside(params.fine, cell)) return;
    mat4 own;
    bool is_lit = false;
    for (int i = 0; i < LOBE_COEFFICIENTS; ++i) {
        own[i] = imageLoad(sum, sum_texel(params.fine, cell, i));
        is_lit = is_lit || any(notEqual(own[i].rgb, vec3(0.0)));
    }
    if (FINEST && is_lit) return;
    for (int i = 0; i < LOBE_COEFFICIENTS; ++i) {
        vec4 coarse = imageLoad(coarse_sum, sum_texel(params.coarse, cell >> 1, i));
        imageStore(sum, sum_texel(params.fine, cell, i), FINEST ? coarse : own[i] + coarse);
    }
}
