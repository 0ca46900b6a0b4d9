#version 460
#extension GL_GOOGLE_include_directive : require
// lpv.leaf_sweep: the leaves of one step of the sweep, for all directions of some octants.
//
// As lpv.sweep, for leaves of different size:
//
//   L = (|ωx| Lx + |ωy| Ly + |ωz| Lz + Q) / (|ωx| + |ωy| + |ωz|),  Q = max(0, F·ω) / (π H²)
//
// H is the edge of the leaf, Lx the mean over its upwind face along x: of one neighbour as large or
// larger, or of four that are half as large. Each has a slot in the front from when it is computed
// until its last reader is done; two slots have what comes from opaque faces and from the border.
layout(local_size_x = 64) in;

#include "gi/lpv/directions.glsl"
#include "gi/lpv/grid.glsl"
#include "gi/lpv/harmonics.glsl"
#include "gi/lpv/octree/leaves.glsl"
#include "gi/lpv/pairs.glsl"

layout(constant_id = 0) const bool ADD = false;     // to what other octants have left
layout(constant_id = 1) const bool SIDES = false;   // opaque faces send light

layout(std430, set = 1, binding = 0) restrict readonly buffer Directions {
    uvec4 octants[8];      // x: its first pair of directions; y: how many pairs it has
    Direction directions[];
};
// octant by octant. x, y: first leaf in `order`, first row in `rows`; z, w: how many leaves have
// one row, and how many four
layout(std430, set = 1, binding = 1) restrict readonly buffer Steps { uvec4 steps[]; };
layout(set = 1, binding = 2, r32ui) uniform restrict readonly uimage2D order;
// the slots of the upwind neighbours along x, y and z, and the leaf's own
layout(set = 1, binding = 3, rgba16ui) uniform restrict readonly uimage2D rows;
layout(set = 1, binding = 4, rgba32ui) uniform restrict readonly uimage3D sources;
// radiance that is still needed, at a slot; z: octant, pair of directions. A texel has two times
// four half floats.
layout(set = 1, binding = 5, rgba32ui) uniform restrict uimage3D front;
// sums over the directions of an octant, of a leaf; z: octant, pair of coefficients
layout(set = 1, binding = 6, rgba32ui) uniform restrict uimage3D slabs;
layout(std430, set = 1, binding = 7) restrict readonly buffer SideLight { vec4 side_light[]; };

layout(push_constant) uniform LeafSweepParams {
    uint step;
    uint step_count;
    uint first_octant;
    uint most_pairs;         // pairs of directions that an octant has at most
} params;

void main() {
    int slab = int(gl_GlobalInvocationID.y);
    uint octant = params.first_octant + uint(slab);
    uvec4 step = steps[octant * params.step_count + params.step];
    uint at = gl_GlobalInvocationID.x, ones = step.z;
    if (at >= ones + step.w) return;
    uint first_row = step.y + (at < ones ? at : 4u * at - 3u * ones);
    // As many rows for all threads of a workgroup, in most of which each has one: a thread of one
    // row reads it four times where others have four.
    uint rows_of_group = (gl_WorkGroupID.x + 1u) * gl_WorkGroupSize.x <= ones ? 1u : 4u;
    uint last_row = at < ones ? first_row : first_row + 3u;
    uint leaf = imageLoad(order, list_texel(step.x + at)).x;
    uvec4 red = imageLoad(sources, leaf_texel(leaf, 0)),
          green = imageLoad(sources, leaf_texel(leaf, 1)),
          blue = imageLoad(sources, leaf_texel(leaf, 2));
    // times a direction: r, g, b
    mat3 source = transpose(mat3(
        uintBitsToFloat(red.xyz), uintBitsToFloat(green.xyz), uintBitsToFloat(blue.xyz)));

    // Light of opaque faces, in place of that of the black slot.
    mat3x4 side = mat3x4(0.0);
    if (SIDES) {
        for (uint axis = 0u; axis < 3u; ++axis) {
            uint face = 2u * axis + (octant >> axis & 1u);
            if ((red.w >> face & 1u) != 0u) side[axis] = side_light[side_of(red.w, face)];
        }
    }

    vec4 sums[COEFFICIENTS + 1];
    for (int i = 0; i <= COEFFICIENTS; ++i) sums[i] = vec4(0.0);

    uint first = octants[octant].x, count = octants[octant].y;
    for (uint k = 0u; k < count; ++k) {
        int layer = slab * int(params.most_pairs) + int(k);
        Direction both[2] =
            Direction[2](directions[2u * (first + k)], directions[2u * (first + k) + 1u]);
        vec4 pair[2] = vec4[2](both[0].travel, both[1].travel);
        vec3 steepness[2] = vec3[2](abs(pair[0].xyz), abs(pair[1].xyz));
        Pair here = Pair(vec4[2](vec4(0.0), vec4(0.0)));
        uint row = 0u;
        uint own;
        do {
            uvec4 slots = imageLoad(rows, list_texel(min(first_row + row, last_row)));
            own = slots.w;
            Pair x = unpack(imageLoad(front, slot_texel(slots.x, layer))),
                 y = unpack(imageLoad(front, slot_texel(slots.y, layer))),
                 z = unpack(imageLoad(front, slot_texel(slots.z, layer)));
            for (int i = 0; i < 2; ++i)
                here.radiance[i] += steepness[i].x * x.radiance[i]
                    + steepness[i].y * y.radiance[i] + steepness[i].z * z.radiance[i];
        } while (++row < rows_of_group);
        for (int i = 0; i < 2; ++i) {
            vec4 sent = here.radiance[i] / float(rows_of_group);
            sent += vec4(max(source * pair[i].xyz, vec3(0.0)), 0.0);
            if (SIDES) sent += side * steepness[i];
            here.radiance[i] = sent / (steepness[i].x + steepness[i].y + steepness[i].z);
        }
        // Both at once: the sums are more than fit into registers.
        vec4 weighted[2] = vec4[2](pair[0].w * with_sky(both[0], here.radiance[0]),
            pair[1].w * with_sky(both[1], here.radiance[1]));
        float basis[COEFFICIENTS] = sh_evaluate3(-pair[0].xyz);
        float other[COEFFICIENTS] = sh_evaluate3(-pair[1].xyz);
        for (int i = 0; i < COEFFICIENTS; ++i)
            sums[i] += basis[i] * weighted[0] + other[i] * weighted[1];
        imageStore(front, slot_texel(own, layer), pack(here));
    }
    for (int i = 0; i < COEFFICIENT_PAIRS; ++i) {
        ivec3 texel = leaf_texel(leaf, slab * COEFFICIENT_PAIRS + i);
        Pair sum = Pair(vec4[2](sums[2 * i], sums[2 * i + 1]));
        if (ADD) {
            Pair before = unpack(imageLoad(slabs, texel));
            sum.radiance[0] += before.radiance[0];
            sum.radiance[1] += before.radiance[1];
        }
        imageStore(slabs, texel, pack(sum));
    }
}
