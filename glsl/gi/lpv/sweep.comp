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
//
// A coarser grid hands on what comes to the border of a finer one inside it, whose cells are half
// as large: cells in front of the border leave their radiance there, and the finer sweep begins
// with it.
layout(local_size_x = 256) in;

#include "gi/lpv/directions.glsl"
#include "gi/lpv/grid.glsl"
#include "gi/lpv/harmonics.glsl"
#include "gi/lpv/pairs.glsl"

layout(constant_id = 0) const bool ADD = false;     // to what other octants have left
layout(constant_id = 1) const bool SIDES = false;   // opaque faces send light
layout(constant_id = 2) const bool IS_INNER = false;   // a coarser grid's light comes in
layout(constant_id = 3) const bool HAS_INNER = false;  // a finer grid inside takes light
layout(constant_id = 4) const bool SLABS = false;      // several octants at once, each with a slab
layout(constant_id = 5) const bool KEEP = false;       // the radiance of all cells

layout(std430, set = 1, binding = 0) restrict readonly buffer Directions {
    uvec4 octants[8];      // x: its first pair of directions; y: how many pairs it has
    Direction directions[];
};
layout(set = 1, binding = 1, r32ui) uniform restrict readonly uimage2D order;
layout(set = 1, binding = 2, rgba32ui) uniform restrict readonly uimage3D sources;
// radiance of the cells of this step and of the one before: x, y: a, b; z: octant, pair of
// directions, parity of the step. With KEEP, of all cells: x, y: of the cell; z: octant, pair of
// directions, z of the cell. A texel has two times four half floats.
layout(set = 1, binding = 3, rgba32ui) uniform restrict uimage3D front;
// sums over the directions of an octant: x: pair of coefficients and x of the cell; z: octant, z
layout(set = 1, binding = 4, rgba32ui) uniform restrict uimage3D slabs;
layout(std430, set = 1, binding = 5) restrict readonly buffer SideLight { vec4 side_light[]; };
// what comes to the borders of finer grids, in texels as of front: x, y: cell of the coarser grid
// along the border, for one finer grid after the other along y; z: octant, axis, pair of directions
layout(set = 1, binding = 6, rgba32ui) uniform restrict uimage3D borders;
layout(set = 1, binding = 7, rgba16f) uniform restrict image3D light;
layout(set = 1, binding = 8, rgba16f) uniform restrict image3D light_band2;
layout(set = 1, binding = 9, rgba16ui) uniform restrict readonly uimage3D source_faces;

layout(push_constant) uniform SweepParams {
    CellGrid grid;           // size.w: pairs of directions that an octant has at most
    uint step;
    uint first_cell;         // of the step, in the order
    uint cell_count;
    uint first_octant;
    ivec4 inner;             // xyz: the finer grid's first cell; w: its cells along each axis
    ivec4 rows;              // where borders begin along y; x: the own one, y: the finer grid's
    uint first_pair;         // of each octant
    uint pair_count;
} params;

const uint ORDER_ROW = 1024u;   // Rust: ORDER_ROW of lpv::sweep

#include "gi/lpv/pairs.glsl"
#include "gi/lpv/sources.glsl"
#include "gi/lpv/store_light.glsl"

const ivec3 NOWHERE = ivec3(0, 0, -4096);   // whichever pair of directions is added

// What comes from the upwind neighbour along an axis; where there is none, what comes to the
// border, or `otherwise`.
Pair upwind(ivec3 neighbour, bool is_there, ivec3 border, vec4 otherwise) {
    if (is_there) return unpack(imageLoad(front, neighbour));
    if (IS_INNER && border.z >= 0) return unpack(imageLoad(borders, border));
    return Pair(vec4[2](otherwise, otherwise));
}

// Where the first pair of directions comes to a border along an axis, at a cell of the coarser grid
// behind it, from the finer grid's first.
ivec3 border_texel(ivec3 behind, uint octant, int axis, int row) {
    return ivec3(behind[(axis + 1) % 3], row + behind[(axis + 2) % 3],
        (3 * int(octant) + axis) * params.grid.size.w);
}

// Where a cell leaves its radiance for a finer grid that it is in front of.
ivec3 outward_texel(ivec3 cell, uint octant, bvec3 is_reversed) {
    ivec3 place = cell - params.inner.xyz;
    for (int axis = 0; axis < 3; ++axis) {
        ivec3 behind = place;
        behind[axis] += is_reversed[axis] ? -1 : 1;
        bool is_in_front = place[axis] == (is_reversed[axis] ? params.inner.w : -1);
        if (is_in_front && all(greaterThanEqual(behind, ivec3(0)))
            && all(lessThan(behind, ivec3(params.inner.w))))
            return border_texel(behind, octant, axis, params.rows.y);
    }
    return NOWHERE;
}

void add_to_slab(ivec3 texel, vec4 sums[COEFFICIENTS + 1]) {
    for (int i = 0; i < COEFFICIENT_PAIRS; ++i) {
        Pair sum = Pair(vec4[2](sums[2 * i], sums[2 * i + 1]));
        if (ADD) {
            Pair before = unpack(imageLoad(slabs, texel));
            sum.radiance[0] += before.radiance[0];
            sum.radiance[1] += before.radiance[1];
        }
        imageStore(slabs, texel, pack(sum));
        texel.x += params.grid.size.x;
    }
}

void add_to_light(ivec3 cell, vec4 sums[COEFFICIENTS + 1]) {
    for (int i = 0; i < COEFFICIENTS; ++i) {
        vec4 sum = sums[i];
        if (ADD) {
            ivec3 texel = light_texel(params.grid, cell, i);
            sum += i < LOW_COEFFICIENTS ? imageLoad(light, texel) : imageLoad(light_band2, texel);
        }
        store_light(params.grid, cell, i, sum);
    }
}

void main() {
    if (gl_GlobalInvocationID.x >= params.cell_count) return;
    ivec3 size = params.grid.size.xyz;
    uint number = params.first_cell + gl_GlobalInvocationID.x;
    uint packed_ab = imageLoad(order, ivec2(number % ORDER_ROW, number / ORDER_ROW)).x;
    ivec2 ab = ivec2(packed_ab & 0xffffu, packed_ab >> 16);
    ivec3 own = ivec3(ab, int(params.step) - ab.x - ab.y);
    int slab = int(gl_GlobalInvocationID.y);
    uint octant = params.first_octant + uint(slab);
    bvec3 is_reversed = bvec3((octant & 1u) != 0u, (octant & 2u) != 0u, (octant & 4u) != 0u);
    ivec3 cell = mix(own, size - 1 - own, is_reversed);
    CellSource found = load_source(cell);

    // What comes in where there is no upwind neighbour: light of the opaque face, or of the
    // environment.
    uint word = found.faces;
    bvec3 is_there;
    mat3x4 otherwise;
    ivec3 border[3] = ivec3[3](NOWHERE, NOWHERE, NOWHERE);
    for (uint axis = 0u; axis < 3u; ++axis) {
        uint face = 2u * axis + uint(is_reversed[axis]);
        bool is_opaque = (word >> face & 1u) != 0u;
        is_there[axis] = !is_opaque && own[axis] > 0;
        otherwise[axis] = is_opaque ? vec4(0.0) : vec4(0.0, 0.0, 0.0, 1.0);
        if (SIDES && is_opaque) otherwise[axis] = side_light[side_of(word, face)];
        if (IS_INNER && !is_opaque)
            border[axis] = border_texel(cell >> 1, octant, int(axis), params.rows.x);
    }
    ivec3 outward = HAS_INNER ? outward_texel(cell, octant, is_reversed) : NOWHERE;

    vec4 sums[COEFFICIENTS + 1];
    for (int i = 0; i <= COEFFICIENTS; ++i) sums[i] = vec4(0.0);

    // From a cell's place to those of its upwind neighbours.
    int parity = int(params.step & 1u), flip = 1 - 2 * parity;
    ivec3 place = KEEP ? cell : ivec3(ab, parity);
    ivec3 upwards = mix(ivec3(-1), ivec3(1), is_reversed);
    ivec3 to_x = KEEP ? ivec3(upwards.x, 0, 0) : ivec3(-1, 0, flip),
          to_y = KEEP ? ivec3(0, upwards.y, 0) : ivec3(0, -1, flip),
          to_z = KEEP ? ivec3(0, 0, upwards.z) : ivec3(0, 0, flip);
    int layers = KEEP ? size.z : 2, first_layer = slab * int(params.pair_count) * layers;
    uint first = octants[octant].x;
    uint end = min(octants[octant].y, params.first_pair + params.pair_count);
    for (uint k = params.first_pair; k < end; ++k) {
        ivec3 texel = place + ivec3(0, 0, first_layer + int(k - params.first_pair) * layers);
        ivec3 behind = ivec3(0, 0, int(k));
        Pair x = upwind(texel + to_x, is_there.x, border[0] + behind, otherwise[0]),
             y = upwind(texel + to_y, is_there.y, border[1] + behind, otherwise[1]),
             z = upwind(texel + to_z, is_there.z, border[2] + behind, otherwise[2]), here;
        Direction both[2] =
            Direction[2](directions[2u * (first + k)], directions[2u * (first + k) + 1u]);
        vec4 pair[2] = vec4[2](both[0].travel, both[1].travel);
        for (int i = 0; i < 2; ++i) {
            vec3 steepness = abs(pair[i].xyz);
            vec4 sent = vec4(max(pair[i].xyz * found.vectors, vec3(0.0)), 0.0);
            sent += steepness.x * x.radiance[i] + steepness.y * y.radiance[i]
                + steepness.z * z.radiance[i];
            here.radiance[i] = sent / (steepness.x + steepness.y + steepness.z);
        }
        // Both at once: the sums are more than fit into registers.
        vec4 weighted[2] = vec4[2](pair[0].w * with_sky(both[0], here.radiance[0]),
            pair[1].w * with_sky(both[1], here.radiance[1]));
        float basis[COEFFICIENTS] = sh_evaluate3(-pair[0].xyz);
        float other[COEFFICIENTS] = sh_evaluate3(-pair[1].xyz);
        for (int i = 0; i < COEFFICIENTS; ++i)
            sums[i] += basis[i] * weighted[0] + other[i] * weighted[1];
        uvec4 packed = pack(here);
        imageStore(front, texel, packed);
        if (HAS_INNER && outward.z >= 0)
            imageStore(borders, outward + ivec3(0, 0, int(k)), packed);
    }
    if (SLABS) {
        add_to_slab(cell + ivec3(0, 0, slab * size.z), sums);
    } else {
        add_to_light(cell, sums);
    }
}
