#version 460
#extension GL_GOOGLE_include_directive : require
// lpv.jacobi_sum: what the last step has left along some pairs of directions, added to the light of
// the pairs before. That is kept in floats: half floats would lose what later pairs add to it.
layout(local_size_x = 8, local_size_y = 8) in;

#include "gi/lpv/directions.glsl"
#include "gi/lpv/grid.glsl"
#include "gi/lpv/harmonics.glsl"
#include "gi/lpv/pairs.glsl"

layout(std430, set = 1, binding = 0) restrict readonly buffer Directions {
    uvec4 octants[8];
    Direction directions[];
};
layout(set = 1, binding = 1, rgba32ui) uniform restrict readonly uimage3D fields;
layout(set = 1, binding = 2, rgba32f) uniform restrict image3D sum;
layout(set = 1, binding = 3, rgba16f) uniform restrict writeonly image3D light;
layout(set = 1, binding = 4, rgba16f) uniform restrict writeonly image3D light_band2;

layout(push_constant) uniform JacobiParams {
    CellGrid grid;       // size.w: pairs of directions that a half of the volume has room for
    uint first_pair;
    uint pair_count;
    uint step;           // the last one
} params;

#include "gi/lpv/store_light.glsl"

void main() {
    ivec3 size = params.grid.size.xyz, cell = ivec3(gl_GlobalInvocationID);
    if (!is_inside(params.grid, cell)) return;
    int first_layer = int(params.step & 1u) * params.grid.size.w;
    vec4 sums[COEFFICIENTS];
    for (int i = 0; i < COEFFICIENTS; ++i) sums[i] = vec4(0.0);
    for (uint k = 0u; k < params.pair_count; ++k) {
        ivec3 texel = cell + ivec3(0, 0, (first_layer + int(k)) * size.z);
        Pair here = unpack(imageLoad(fields, texel));
        for (uint i = 0u; i < 2u; ++i) {
            Direction direction = directions[2u * (params.first_pair + k) + i];
            vec4 weighted = direction.travel.w * with_sky(direction, here.radiance[i]);
            float basis[COEFFICIENTS] = sh_evaluate3(-direction.travel.xyz);
            for (int c = 0; c < COEFFICIENTS; ++c)
                sums[c] += basis[c] * weighted;
        }
    }
    for (int i = 0; i < COEFFICIENTS; ++i) {
        ivec3 texel = cell + ivec3(i % 3, i / 3, 0) * size;
        if (params.first_pair > 0u) sums[i] += imageLoad(sum, texel);
        imageStore(sum, texel, sums[i]);
        store_light(params.grid, cell, i, sums[i]);
    }
}
