#version 460
#extension GL_GOOGLE_include_directive : require
// lpv.finish: the sum of all steps as the light that is looked up.
//
// In a steady field a cell passes on I(ω) = L(ω) h² (|ωx| + |ωy| + |ωz|), whose mean factor is 3/2:
// L = (2/3) I / h², and E is the integral of that over a clamped cosine. Light that goes along ω
// comes from −ω, so odd bands change their sign.
layout(local_size_x = 8, local_size_y = 8) in;

#include "gi/lpv/light.glsl"
#include "gi/lpv/lobes.glsl"

layout(set = 1, binding = 0, rgba32f) uniform restrict readonly image3D sum;
layout(set = 1, binding = 1, rgba16f) uniform restrict writeonly image3D light;

layout(push_constant) uniform FinishParams { CellGrid grid; } params;

void main() {
    ivec3 cell = ivec3(gl_GlobalInvocationID);
    if (!is_inside(params.grid, cell)) return;
    for (int i = 0; i < LOBE_COEFFICIENTS; ++i) {
        vec4 found = imageLoad(sum, sum_texel(params.grid, cell, i));
        imageStore(light, light_texel(params.grid, cell, i),
            (band_of(i) == 1 ? -2.0 : 2.0) / 3.0 * found);
    }
}
