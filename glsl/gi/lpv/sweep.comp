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
layout(local_size_x = 256) in;

#include "gi/lpv/grid.glsl"
#include "gi/lpv/harmonics.glsl"

layout(constant_id = 0) const bool ADD = false;     // to what other octants have left
layout(constant_id = 1) const bool SIDES = false;   // opaque faces send light

layout(std430, set = 1, binding = 0) restrict readonly buffer Directions {
    uvec4 octants[8];      // x: its first pair of directions; y: how many pairs it has
    vec4 directions[];     // xyz: unit vector of travel; w: weight [sr]
};
layout(set = 1, binding = 1, r32ui) uniform restrict readonly uimage2D order;
layout(set = 1, binding = 2, rgba32ui) uniform restrict readonly uimage3D sources;
// radiance of the cells of this step and of the one before: x, y: a, b; z: octant, pair of
// directions, parity of the step. A texel has two times four half floats.
layout(set = 1, binding = 3, rgba32ui) uniform restrict uimage3D front;
// sums over the directions of an octant: x: pair of coefficients and x of the cell; z: octant, z
layout(set = 1, binding = 4, rgba32ui) uniform restrict uimage3D slabs;
layout(std430, set = 1, binding = 5) restrict readonly buffer SideLight { vec4 side_light[]; };

layout(push_constant) uniform SweepParams {
    CellGrid grid;           // size.w: pairs of directions that an octant has at most
    uint step;
    uint first_cell;         // of the step, in the order
    uint cell_count;
    uint first_octant;
} params;

const uint ORDER_ROW = 1024u;   // Rust: ORDER_ROW of lpv::sweep

struct Pair { vec4 radiance[2]; };


uvec4 pack(Pair pair) {
    return uvec4(packHalf2x16(pair.radiance[0].xy), packHalf2x16(pair.radiance[0].zw),
        packHalf2x16(pair.radiance[1].xy), packHalf2x16(pair.radiance[1].zw));
}

Pair unpack(uvec4 words) {
    return Pair(vec4[2](vec4(unpackHalf2x16(words.x), unpackHalf2x16(words.y)),
        vec4(unpackHalf2x16(words.z), unpackHalf2x16(words.w))));
}

// What comes from the upwind neighbour along an axis; `otherwise`, where there is none.
Pair upwind(ivec3 neighbour, bool is_there, vec4 otherwise) {
    return is_there ? unpack(imageLoad(front, neighbour))
                    : Pair(vec4[2](otherwise, otherwise));
}

void main() {
    if (gl_GlobalInvocationID.x >= params.cell_count) return;
    ivec3 size = params.grid.size.xyz;
    uint place = params.first_cell + gl_GlobalInvocationID.x;
    uint packed_ab = imageLoad(order, ivec2(place % ORDER_ROW, place / ORDER_ROW)).x;
    ivec2 ab = ivec2(packed_ab & 0xffffu, packed_ab >> 16);
    ivec3 own = ivec3(ab, int(params.step) - ab.x - ab.y);
    int slab = int(gl_GlobalInvocationID.y);
    uint octant = params.first_octant + uint(slab);
    bvec3 is_reversed = bvec3((octant & 1u) != 0u, (octant & 2u) != 0u, (octant & 4u) != 0u);
    ivec3 cell = mix(own, size - 1 - own, is_reversed);
    uvec4 red = imageLoad(sources, cell), green = imageLoad(sources, cell + ivec3(size.x, 0, 0)),
          blue = imageLoad(sources, cell + ivec3(2 * size.x, 0, 0));
    // times a direction: r, g, b
    mat3 source = transpose(mat3(
        uintBitsToFloat(red.xyz), uintBitsToFloat(green.xyz), uintBitsToFloat(blue.xyz)));

    // What comes in where there is no upwind neighbour: light of the opaque face, or of the
    // environment.
    uint word = red.w;
    bvec3 is_there;
    mat3x4 otherwise;
    for (uint axis = 0u; axis < 3u; ++axis) {
        uint face = 2u * axis + uint(is_reversed[axis]);
        bool is_opaque = (word >> face & 1u) != 0u;
        is_there[axis] = !is_opaque && own[axis] > 0;
        otherwise[axis] = is_opaque ? vec4(0.0) : vec4(0.0, 0.0, 0.0, 1.0);
        if (SIDES && is_opaque) otherwise[axis] = side_light[side_of(word, face)];
    }

    vec4 sums[COEFFICIENTS + 1];
    for (int i = 0; i <= COEFFICIENTS; ++i) sums[i] = vec4(0.0);

    int parity = int(params.step & 1u);
    uint first = octants[octant].x, count = octants[octant].y;
    for (uint k = 0u; k < count; ++k) {
        int layer = 2 * (slab * params.grid.size.w + int(k));
        ivec3 before = ivec3(ab, layer + 1 - parity);
        Pair x = upwind(before - ivec3(1, 0, 0), is_there.x, otherwise[0]),
             y = upwind(before - ivec3(0, 1, 0), is_there.y, otherwise[1]),
             z = upwind(before, is_there.z, otherwise[2]), here;
        vec4 pair[2] = vec4[2](directions[2u * (first + k)], directions[2u * (first + k) + 1u]);
        for (int i = 0; i < 2; ++i) {
            vec3 steepness = abs(pair[i].xyz);
            vec4 sent = vec4(max(source * pair[i].xyz, vec3(0.0)), 0.0);
            sent += steepness.x * x.radiance[i] + steepness.y * y.radiance[i]
                + steepness.z * z.radiance[i];
            here.radiance[i] = sent / (steepness.x + steepness.y + steepness.z);
        }
        // Both at once: the sums are more than fit into registers.
        vec4 weighted[2] = vec4[2](pair[0].w * here.radiance[0], pair[1].w * here.radiance[1]);
        float basis[COEFFICIENTS] = sh_evaluate3(-pair[0].xyz);
        float other[COEFFICIENTS] = sh_evaluate3(-pair[1].xyz);
        for (int i = 0; i < COEFFICIENTS; ++i)
            sums[i] += basis[i] * weighted[0] + other[i] * weighted[1];
        imageStore(front, ivec3(ab, layer + parity), pack(here));
    }
    for (int i = 0; i < COEFFICIENT_PAIRS; ++i) {
        ivec3 texel = cell + ivec3(i * size.x, 0, slab * size.z);
        Pair sum = Pair(vec4[2](sums[2 * i], sums[2 * i + 1]));
        if (ADD) {
            Pair before = unpack(imageLoad(slabs, texel));
            sum.radiance[0] += before.radiance[0];
            sum.radiance[1] += before.radiance[1];
        }
        imageStore(slabs, texel, pack(sum));
    }
}
