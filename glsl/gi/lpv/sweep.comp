#version 460
#extension GL_GOOGLE_include_directive : require
// lpv.sweep: the cells of one step of the sweep, for all directions of some octants.
//
// Light goes from a cell to its three downwind neighbours. In the octant's own order a cell (a, b,
// c) needs (a − 1, b, c), (a, b − 1, c) and (a, b, c − 1), so that all cells with a + b + c = step
// are independent of each other. Radiance along ω_k:
//
//   L = (|ωx| Lx + |ωy| Ly + |ωz| Lz + Q) / (|ωx| + |ωy| + |ωz|),  Q = max(0, F·ω_k) / (π h²)
//
// Lx is the upwind neighbour's along x: 0 behind an opaque face. What a cell has is added to
// spherical harmonics of the directions that its light comes from. Alpha is the light of an
// environment of radiance 1.
layout(local_size_x = 8, local_size_y = 8) in;

#include "gi/lpv/grid.glsl"
#include "gi/lpv/sh.glsl"

layout(constant_id = 0) const bool ADD = false;   // to what other octants have left

layout(std430, set = 1, binding = 0) restrict readonly buffer Directions {
    uvec4 octants[8];      // x: its first direction; y: how many it has
    vec4 directions[];     // xyz: unit vector of travel; w: weight [sr]
};
layout(std430, set = 1, binding = 1) restrict readonly buffer Faces { uint faces[]; };
layout(std430, set = 1, binding = 2) restrict readonly buffer Flux { int flux[]; };
// radiance of the cells of this step and of the one before, by octant, direction, parity, b, a
layout(std430, set = 1, binding = 3) restrict buffer Front { vec4 front[]; };
layout(set = 1, binding = 4, rgba16f) uniform restrict image3D light;

layout(push_constant) uniform SweepParams {
    CellGrid grid;           // size.w: directions that an octant has at most
    ivec4 step;              // x: step; y, z: first a and b of it; w: first octant
    float radiance_unit;     // one integer step of flux, over π h² [W/(m² sr)]
} params;

const vec4 INFLOW = vec4(0.0, 0.0, 0.0, 1.0);

void main() {
    ivec3 size = params.grid.size.xyz;
    ivec2 ab = ivec2(gl_GlobalInvocationID.xy) + params.step.yz;
    ivec3 own = ivec3(ab, params.step.x - ab.x - ab.y);
    if (any(lessThan(own, ivec3(0))) || any(greaterThanEqual(own, size))) return;
    int slab = int(gl_GlobalInvocationID.z), octant = params.step.w + slab;
    bvec3 is_reversed = bvec3((octant & 1) != 0, (octant & 2) != 0, (octant & 4) != 0);
    ivec3 cell = mix(own, size - 1 - own, is_reversed);
    int index = cell_index(params.grid, cell), cells = size.x * size.y * size.z;

    uvec3 upwind_face = uvec3(0u, 2u, 4u) + uvec3(is_reversed);
    bvec3 is_open = equal(uvec3(faces[index]) >> upwind_face & 1u, uvec3(0u));
    bvec3 is_border = equal(own, ivec3(0));

    mat3 source;
    for (int colour = 0; colour < 3; ++colour)
        for (int axis = 0; axis < 3; ++axis)
            source[axis][colour] =
                float(flux[(3 * colour + axis) * cells + index]) * params.radiance_unit;

    vec4 sums[COEFFICIENTS];
    for (int i = 0; i < COEFFICIENTS; ++i) sums[i] = vec4(0.0);

    int plane = size.x * size.y, at = ab.x + size.x * ab.y;
    int parity = params.step.x & 1;
    uint first = octants[octant].x, count = octants[octant].y;
    for (uint k = 0u; k < count; ++k) {
        vec4 direction = directions[first + k];
        vec3 steepness = abs(direction.xyz);
        int row = ((slab * params.grid.size.w + int(k)) * 2) * plane + at;
        int before = row + (1 - parity) * plane;
        vec4 radiance = vec4(max(source * direction.xyz, vec3(0.0)), 0.0);
        if (is_open.x)
            radiance += steepness.x * (is_border.x ? INFLOW : front[before - 1]);
        if (is_open.y)
            radiance += steepness.y * (is_border.y ? INFLOW : front[before - size.x]);
        if (is_open.z) radiance += steepness.z * (is_border.z ? INFLOW : front[before]);
        radiance /= steepness.x + steepness.y + steepness.z;
        front[row + parity * plane] = radiance;

        float basis[COEFFICIENTS];
        sh_basis(-direction.xyz, basis);
        radiance *= direction.w;
        for (int i = 0; i < COEFFICIENTS; ++i) sums[i] += basis[i] * radiance;
    }
    ivec3 home = cell + ivec3(0, 0, slab * size.z);
    for (int i = 0; i < COEFFICIENTS; ++i) {
        ivec3 texel = light_texel(params.grid, home, i);
        imageStore(light, texel, ADD ? sums[i] + imageLoad(light, texel) : sums[i]);
    }
}
