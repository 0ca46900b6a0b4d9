#version 460
#extension GL_GOOGLE_include_directive : require
// lpv.seed: what cells send at first. The texels of a cell are together
//
//   I(ω) = Σ (Φ/π) ⟨n,ω⟩₊,  c_0 = (√π/2) ΣΦ / π,  c_1 = √(π/3) ΣΦn / π
//
// An opaque face that sends radiance L into its cell is a lobe L h² along its axis: its flux is
// π L h².
layout(local_size_x = 8, local_size_y = 8) in;

#include "gi/lpv/lobes.glsl"
#include "gi/shared/sh.glsl"

layout(constant_id = 0) const bool SIDES = false;   // opaque faces send light

layout(std430, set = 1, binding = 0) restrict readonly buffer Flux { int flux[]; };
layout(std430, set = 1, binding = 1) restrict readonly buffer Faces { uint faces[]; };
layout(std430, set = 1, binding = 2) restrict readonly buffer SideLight { vec4 side_light[]; };
layout(set = 1, binding = 3, rgba32ui) uniform restrict writeonly uimage3D lobes;
layout(set = 1, binding = 4, rgba32f) uniform restrict writeonly image3D sum;

layout(push_constant) uniform SeedParams {
    CellGrid grid;
    float peak_unit;   // one integer step of flux, over π h² [W/(m² sr)]
} params;

void main() {
    ivec3 size = params.grid.size.xyz, cell = ivec3(gl_GlobalInvocationID);
    if (!is_inside(params.grid, cell)) return;
    int index = cell_index(params.grid, cell), cells = size.x * size.y * size.z;
    mat4 sent = mat4(0.0);
    for (int colour = 0; colour < 3; ++colour) {
        vec3 vector;
        for (int axis = 0; axis < 3; ++axis)
            vector[axis] = float(flux[(3 * colour + axis) * cells + index]);
        float power = float(flux[(9 + colour) * cells + index]);
        vec4 lobe = vec4(SH_COSINE.x * SH_Y0 * power, SH_COSINE.y * SH_Y1 * vector.yzx);
        for (int i = 0; i < LOBE_COEFFICIENTS; ++i) sent[i][colour] = lobe[i] * params.peak_unit;
    }
    uint word = SIDES ? faces[index] : 0u;
    for (uint face = 0u; face < 6u; ++face)
        if ((word >> face & 1u) != 0u)
            sent += outerProduct(
                side_light[side_of(word, face)], sh_cosine_lobe2(-axis_direction(face)));
    for (int i = 0; i < LOBE_COEFFICIENTS; ++i)
        imageStore(sum, sum_texel(params.grid, cell, i), sent[i]);
    for (int i = 0; i < 2; ++i)
        imageStore(lobes, pair_texel(params.grid, cell, i, 0u), pack(sent[2 * i], sent[2 * i + 1]));
}
