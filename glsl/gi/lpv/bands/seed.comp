#version 460
#extension GL_GOOGLE_include_directive : require
// lpv.seed_bands: what cells send at first, in three or four bands. Of each colour the texels of a
// cell are together
//
//   I(ω) = max(0, F·ω)/π,  c_lm = A_l |F| Y_lm(F/|F|)/π,  F = Σ Φ n
//
// An opaque face that sends radiance L into its cell is a lobe L h² along its axis.
layout(local_size_x = 8, local_size_y = 8) in;

#include "gi/lpv/bands/bands.glsl"

layout(constant_id = 1) const bool SIDES = false;   // opaque faces send light

layout(std430, set = 1, binding = 0) restrict readonly buffer Flux { int flux[]; };
layout(std430, set = 1, binding = 1) restrict readonly buffer Faces { uint faces[]; };
layout(std430, set = 1, binding = 2) restrict readonly buffer SideLight { vec4 side_light[]; };
layout(set = 1, binding = 3, rgba32ui) uniform restrict writeonly uimage3D lobes;
layout(set = 1, binding = 4, rgba32f) uniform restrict writeonly image3D sum;

layout(push_constant) uniform SeedParams {
    CellGrid grid;
    float peak_unit;   // one integer step of flux, over π h² [W/(m² sr)]
} params;

void add_lobe(inout vec4 sent[MOST_COEFFICIENTS], vec4 peak, vec3 direction) {
    float basis[MOST_COEFFICIENTS] = sh_evaluate4(direction);
    for (int i = 0; i < BAND_COEFFICIENTS; ++i) sent[i] += cosine_factor(i) * basis[i] * peak;
}

void main() {
    ivec3 size = params.grid.size.xyz, cell = ivec3(gl_GlobalInvocationID);
    if (!is_inside(params.grid, cell)) return;
    int index = cell_index(params.grid, cell), cells = size.x * size.y * size.z;
    vec4 sent[MOST_COEFFICIENTS];
    for (int i = 0; i < MOST_COEFFICIENTS; ++i) sent[i] = vec4(0.0);
    for (int colour = 0; colour < 3; ++colour) {
        int first = 3 * colour * cells + index;
        vec3 vector = vec3(flux[first], flux[first + cells], flux[first + 2 * cells]);
        float size_of_vector = length(vector);
        if (size_of_vector == 0.0) continue;
        vec4 peak = vec4(0.0);
        peak[colour] = params.peak_unit * size_of_vector;
        add_lobe(sent, peak, vector / size_of_vector);
    }
    uint word = SIDES ? faces[index] : 0u;
    for (uint face = 0u; face < 6u; ++face) {
        if ((word >> face & 1u) == 0u) continue;
        vec3 inwards = vec3(0.0);
        inwards[face >> 1] = (face & 1u) != 0u ? -1.0 : 1.0;
        add_lobe(sent, side_light[side_of(word, face)], inwards);
    }
    for (int i = 0; i < BAND_COEFFICIENTS; ++i)
        imageStore(sum, sum_texel(params.grid, cell, i), sent[i]);
    for (int i = 0; i < BAND_PAIRS; ++i) {
        // With three bands the last one's partner is 0.
        vec4 second = 2 * i + 1 < BAND_COEFFICIENTS ? sent[2 * i + 1] : vec4(0.0);
        imageStore(lobes, pair_texel(params.grid, cell, i, 0u),
            pack(Pair(vec4[2](sent[2 * i], second))));
    }
}
