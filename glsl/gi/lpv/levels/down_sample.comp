#version 460
#extension GL_GOOGLE_include_directive : require
// lpv.down_sample: what a cell of the next level begins with.
//
// As published it is the mean of its eight children (Olovsson 2012, eq. 11). Fields of I/h² keep
// their values by that, but the flux of what was injected halves: a cell has four times the face.
// Repaired it is their sum: twice the mean. It has been counted where it was, so the sum of the
// level's steps begins with nothing.
layout(local_size_x = 8, local_size_y = 8) in;

#include "gi/lpv/lobes.glsl"

layout(constant_id = 0) const bool RESIDUAL = false;   // repaired

layout(set = 1, binding = 0, rgba32ui) uniform restrict readonly uimage3D fine_lobes;
layout(set = 1, binding = 1, rgba32ui) uniform restrict writeonly uimage3D lobes;
layout(set = 1, binding = 2, rgba32f) uniform restrict writeonly image3D sum;

layout(push_constant) uniform DownSampleParams {
    CellGrid fine;
    CellGrid coarse;
    uint step;   // the last that has been done
} params;

void main() {
    ivec3 cell = ivec3(gl_GlobalInvocationID);
    if (!is_inside(params.coarse, cell)) return;
    mat4 own = mat4(0.0);
    for (int corner = 0; corner < 8; ++corner) {
        ivec3 child = 2 * cell + ivec3(corner & 1, corner >> 1 & 1, corner >> 2);
        if (!is_inside(params.fine, child)) continue;
        for (int i = 0; i < 2; ++i) {
            vec4 first, second;
            unpack(imageLoad(fine_lobes, pair_texel(params.fine, child, i, params.step)),
                first, second);
            own[2 * i] += first;
            own[2 * i + 1] += second;
        }
    }
    float share = 0.125;
    if (RESIDUAL) share = 0.25;
    own *= share;
    for (int i = 0; i < 2; ++i)
        imageStore(lobes, pair_texel(params.coarse, cell, i, params.step),
            pack(own[2 * i], own[2 * i + 1]));
    for (int i = 0; i < LOBE_COEFFICIENTS; ++i)
        imageStore(sum, sum_texel(params.coarse, cell, i), RESIDUAL ? vec4(0.0) : own[i]);
}
