#version 460
#extension GL_GOOGLE_include_directive : require
// lpv.sum: the light of all octants, into the volume that is looked up.
layout(local_size_x = 8, local_size_y = 8) in;

#include "gi/lpv/grid.glsl"
#include "gi/lpv/harmonics.glsl"

layout(set = 1, binding = 0, rgba32ui) uniform restrict readonly uimage3D slabs;
layout(set = 1, binding = 1, rgba16f) uniform restrict writeonly image3D light;
layout(set = 1, binding = 2, rgba16f) uniform restrict writeonly image3D light_band2;

layout(push_constant) uniform SumParams {
    CellGrid grid;    // size.w: slabs
} params;

#include "gi/lpv/store_light.glsl"

void main() {
    ivec3 size = params.grid.size.xyz, cell = ivec3(gl_GlobalInvocationID);
    if (!is_inside(params.grid, cell)) return;
    for (int pair = 0; pair < COEFFICIENT_PAIRS; ++pair) {
        vec4 first = vec4(0.0), second = vec4(0.0);
        for (int slab = 0; slab < params.grid.size.w; ++slab) {
            uvec4 words = imageLoad(slabs, cell + ivec3(pair * size.x, 0, slab * size.z));
            first += vec4(unpackHalf2x16(words.x), unpackHalf2x16(words.y));
            second += vec4(unpackHalf2x16(words.z), unpackHalf2x16(words.w));
        }
        store_light(params.grid, cell, 2 * pair, first);
        if (2 * pair + 1 < COEFFICIENTS)
            store_light(params.grid, cell, 2 * pair + 1, second);
    }
}
