// What arrives off a surface. The including pass declares `light`, a volume of nine blocks
// (light_texel), and includes shared/gbuffer.glsl before.
#ifndef LUMIVOX_LPV_LOOKUP
#define LUMIVOX_LPV_LOOKUP

#include "gi/lpv/grid.glsl"
#include "gi/lpv/harmonics.glsl"

layout(push_constant) uniform LookupParams {
    CellGrid grid;
    float shift;   // off the surface [cells]
    float scale;   // radiance of a stored 1 [W/(m² sr)]
} params;

void look_up(Surface surface, out vec4 coefficients[COEFFICIENTS]) {
    vec3 size = vec3(params.grid.size.xyz);
    vec3 position = to_cells(params.grid, surface.position_ws);
    position = shifted(position, surface.geometric_normal, params.shift);
    // The blocks lie side by side: half a cell from a block's border the filter stays inside.
    position = clamp(position, vec3(0.5), size - 0.5);
    for (int i = 0; i < COEFFICIENTS; ++i) {
        vec3 texel = position + vec3(i % 3, i / 3, 0.0) * size;
        coefficients[i] =
            textureLod(sampler3D(light, linear_clamp), texel / (size * vec3(3, 3, 1)), 0.0)
            * vec4(vec3(params.scale), 1.0);
    }
}

#endif
