#version 460
#extension GL_GOOGLE_include_directive : require
// lpv.stream: one step of all cells at once in three or four bands. A neighbour passes on the
// fraction max(0, ω·d)/(|ωx| + |ωy| + |ωz|) along d, and the sum of all steps grows by it.
//
// Outside of the grid the first step has the environment, and the others have nothing, as in
// lpv.propagate.
layout(local_size_x = 8, local_size_y = 8) in;

#include "shared/frame.glsl"
#include "gi/lpv/bands/bands.glsl"

layout(constant_id = 1) const uint OCCLUSION = 0u;

layout(std430, set = 1, binding = 0) restrict readonly buffer Faces { uint faces[]; };
layout(std430, set = 1, binding = 1) restrict readonly buffer Streams {
    vec4 outside[MOST_COEFFICIENTS];   // what comes from the environment, for each face
    // of the faces −x, +x, −y, …: the matrix of what goes towards the cell, row by row
    float streams[];
};
layout(set = 1, binding = 2) uniform texture3D blockers;
layout(set = 1, binding = 3, rgba32ui) uniform restrict uimage3D lobes;
layout(set = 1, binding = 4, rgba32f) uniform restrict image3D sum;

layout(push_constant) uniform PropagateParams {
    CellGrid grid;
    uint step;      // from 1
    float gain;     // fraction of the flux that goes on
} params;

#include "gi/lpv/blocking.glsl"

void main() {
    ivec3 cell = ivec3(gl_GlobalInvocationID);
    if (!is_inside(params.grid, cell)) return;
    uint word = OCCLUSION == FACES ? faces[cell_index(params.grid, cell)] : 0u;
    vec4 arrived[MOST_COEFFICIENTS];
    for (int i = 0; i < MOST_COEFFICIENTS; ++i) arrived[i] = vec4(0.0);
    for (uint face = 0u; face < 6u; ++face) {
        if ((word >> face & 1u) != 0u) continue;
        vec3 onwards = vec3(0.0);
        onwards[face >> 1] = (face & 1u) != 0u ? -1.0 : 1.0;
        ivec3 neighbour = cell - ivec3(onwards);
        bool is_there = is_inside(params.grid, neighbour);
        if (!is_there && params.step > 1u) continue;
        float share = passing(blocking_at(vec3(cell) + 0.5 - 0.5 * onwards), onwards);
        for (int pair = 0; pair < BAND_PAIRS; ++pair) {
            Pair sent = Pair(vec4[2](vec4(0.0), vec4(0.0)));
            if (is_there)
                sent = unpack(imageLoad(
                    lobes, pair_texel(params.grid, neighbour, pair, params.step - 1u)));
            else
                sent = Pair(vec4[2](outside[2 * pair], outside[2 * pair + 1]));
            for (int j = 2 * pair; j < min(2 * pair + 2, BAND_COEFFICIENTS); ++j) {
                int row = (int(face) * BAND_COEFFICIENTS + j) * BAND_COEFFICIENTS;
                vec4 passed = share * sent.radiance[j & 1];
                for (int i = 0; i < BAND_COEFFICIENTS; ++i)
                    arrived[i] += streams[row + i] * passed;
            }
        }
    }
    for (int i = 0; i < BAND_COEFFICIENTS; ++i) {
        arrived[i] *= params.gain;
        ivec3 texel = sum_texel(params.grid, cell, i);
        imageStore(sum, texel, imageLoad(sum, texel) + arrived[i]);
    }
    for (int i = 0; i < BAND_PAIRS; ++i) {
        vec4 second = 2 * i + 1 < BAND_COEFFICIENTS ? arrived[2 * i + 1] : vec4(0.0);
        imageStore(lobes, pair_texel(params.grid, cell, i, params.step),
            pack(Pair(vec4[2](arrived[2 * i], second))));
    }
}
