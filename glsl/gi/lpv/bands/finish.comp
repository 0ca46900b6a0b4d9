#version 460
#extension GL_GOOGLE_include_directive : require
// lpv.finish_bands: the sum of all steps in three or four bands as the light that is looked up:
// L = (2/3) I / h², as in lpv.finish. Band 3 has no part in irradiance and is left out.
layout(local_size_x = 8, local_size_y = 8) in;

#include "gi/lpv/bands/bands.glsl"
#include "gi/lpv/harmonics.glsl"

layout(set = 1, binding = 0, rgba32f) uniform restrict readonly image3D sum;
layout(set = 1, binding = 1, rgba16f) uniform restrict writeonly image3D light;
layout(set = 1, binding = 2, rgba16f) uniform restrict writeonly image3D light_band2;

layout(push_constant) uniform FinishParams { CellGrid grid; } params;

#include "gi/lpv/store_light.glsl"

void main() {
    ivec3 cell = ivec3(gl_GlobalInvocationID);
    if (!is_inside(params.grid, cell)) return;
    for (int i = 0; i < COEFFICIENTS; ++i) {
        vec4 found = imageLoad(sum, sum_texel(params.grid, cell, i));
        store_light(params.grid, cell, i, (band_of(i) == 1 ? -2.0 : 2.0) / 3.0 * found);
    }
}
