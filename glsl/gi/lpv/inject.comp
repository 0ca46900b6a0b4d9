#version 460
#extension GL_GOOGLE_include_directive : require
// lpv.inject: texels of the reflective shadow maps add their reflected flux, as a vector along the
// surface's normal, to the cell in front of the surface.
//
// Φ = ρ E A for a parallel light (A: area of a texel across the beam), Φ = ρ I Ω for a perspective
// map (Ω: solid angle of the texel, Olovsson 2012, section 3.3). Sums are integers, the same in
// every run.
layout(local_size_x = 8, local_size_y = 8) in;

#include "shared/light_view.glsl"
#include "gi/lpv/grid.glsl"

layout(constant_id = 0) const bool POWER = false;    // also Φ itself, which lobes need
layout(constant_id = 1) const bool LEAVES = false;   // not cells but leaves have flux

layout(std430, set = 1, binding = 0) restrict readonly buffer LightViews {
    LightView light_views[];
};
layout(set = 1, binding = 1) uniform texture2DArray shadow_maps;
layout(set = 1, binding = 2) uniform utexture2DArray rsm_normal;
layout(set = 1, binding = 3) uniform texture2DArray rsm_reflected;
// x, y, z of red, of green, of blue; each for all cells. Then, with POWER, red, green and blue.
layout(std430, set = 1, binding = 4) restrict buffer Flux { int flux[]; };
layout(std430, set = 1, binding = 5) restrict readonly buffer LeafOf { uint leaf_of[]; };

layout(push_constant) uniform InjectParams {
    CellGrid grid;     // size.w: cells or leaves that have flux
    float flux_unit;   // one integer step [W]
    float shift;       // off the surface [cells]
    uint stride;       // texels along an edge of the square that one texel stands for
} params;

#include "gi/lpv/block.glsl"
#include "gi/lpv/reflected.glsl"

struct Sample {
    int cell;     // or leaf; −1: none
    vec3 normal;
    vec3 flux;    // of r, g, b [W]
};

Sample read_sample(ivec2 square, int layer, LightView view) {
    Reflected found = read_reflected(square, layer, view, int(params.stride));
    if (!found.is_there) return Sample(-1, vec3(0.0), vec3(0.0));
    vec3 root = texelFetch(sampler2DArray(rsm_reflected, nearest_clamp), found.texel, 0).rgb;
    ivec3 cell = ivec3(
        floor(shifted(to_cells(params.grid, found.position), found.normal, params.shift)));
    int index = is_inside(params.grid, cell) ? cell_index(params.grid, cell) : -1;
    if (LEAVES && index >= 0) index = int(leaf_of[index]);
    return Sample(index, found.normal,
        root * root * lights[view.light.x].power_outer.rgb * found.extent);
}

void add(int cell, mat3 sum, vec3 power) {
    int cells = params.grid.size.w;
    for (int colour = 0; colour < 3; ++colour) {
        ivec3 steps = ivec3(round(sum[colour] / params.flux_unit));
        for (int axis = 0; axis < 3; ++axis)
            if (steps[axis] != 0) atomicAdd(flux[(3 * colour + axis) * cells + cell], steps[axis]);
        int step = int(round(power[colour] / params.flux_unit));
        if (POWER && step != 0) atomicAdd(flux[(9 + colour) * cells + cell], step);
    }
}

void main() {
    int layer = int(gl_GlobalInvocationID.z);
    LightView view = light_views[layer];
    ivec2 first = ivec2(gl_GlobalInvocationID.xy) * BLOCK;
    if (any(greaterThanEqual(first * int(params.stride), ivec2(view.light.y)))) return;
    int cell = -1;
    mat3 sum = mat3(0.0);
    vec3 power = vec3(0.0);
    for (int i = 0; i <= BLOCK * BLOCK; ++i) {
        Sample texel = Sample(-1, vec3(0.0), vec3(0.0));
        if (i < BLOCK * BLOCK) texel = read_sample(first + in_block(i), layer, view);
        if (texel.cell != cell) {
            if (cell >= 0) add(cell, sum, power);
            cell = texel.cell;
            sum = mat3(0.0);
            power = vec3(0.0);
        }
        sum += outerProduct(texel.normal, texel.flux);
        power += texel.flux;
    }
}
