#version 460
#extension GL_GOOGLE_include_directive : require
// lpv.ledger: where the light of one step of the sweep goes, beside it: what sources and opaque
// faces send, what enters through the border, what opaque faces take, and what leaves through the
// border, over h² [W/m²]. Each thread adds to numbers of its own, so that the order of threads does
// not matter. Alpha is the same of an environment of radiance 1.
layout(local_size_x = 256) in;

#include "gi/lpv/directions.glsl"
#include "gi/lpv/grid.glsl"

layout(constant_id = 0) const bool SIDES = false;   // opaque faces send light
layout(constant_id = 1) const bool KEEP = false;    // the radiance of all cells is kept

layout(std430, set = 1, binding = 0) restrict readonly buffer Directions {
    uvec4 octants[8];      // x: its first pair of directions; y: how many pairs it has
    Direction directions[];
};
layout(set = 1, binding = 1, r32ui) uniform restrict readonly uimage2D order;
layout(set = 1, binding = 2, rgba32ui) uniform restrict readonly uimage3D sources;
layout(set = 1, binding = 3, rgba32ui) uniform restrict readonly uimage3D front;
layout(std430, set = 1, binding = 4) restrict readonly buffer SideLight { vec4 side_light[]; };
// injected, entered, absorbed, left, on its way, of each thread
layout(std430, set = 1, binding = 5) restrict buffer Ledger { vec4 ledger[]; };
layout(set = 1, binding = 6, rgba16ui) uniform restrict readonly uimage3D source_faces;

layout(push_constant) uniform SweepParams {
    CellGrid grid;           // size.w: pairs of directions that an octant has at most
    uint step;
    uint first_cell;         // of the step, in the order
    uint cell_count;
    uint first_octant;
    ivec4 inner;
    ivec4 rows;
    uint first_pair;         // of each octant
    uint pair_count;
} params;

#include "gi/lpv/pairs.glsl"
#include "gi/lpv/sources.glsl"

const uint ORDER_ROW = 1024u;   // Rust: ORDER_ROW of lpv::sweep
const uint ENTRIES = 5u;        // Rust: ENTRIES of lpv::ledger
const uint INJECTED = 0u, ENTERED = 1u, ABSORBED = 2u, LEFT = 3u;

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
    CellSource source = load_source(cell);

    // Through one unit of each face, what opaque faces send in and what comes from outside.
    mat3x4 sent = mat3x4(0.0), inflow = mat3x4(0.0);
    vec3 is_absorbing = vec3(0.0), is_leaving = vec3(0.0);
    for (uint axis = 0u; axis < 3u; ++axis) {
        uint up = 2u * axis + uint(is_reversed[axis]), down = up ^ 1u;
        if ((source.faces >> up & 1u) != 0u) {
            if (SIDES) sent[axis] = vec4(side_light[side_of(source.faces, up)].rgb, 0.0);
        } else if (own[axis] == 0) {
            inflow[axis] = vec4(0.0, 0.0, 0.0, 1.0);
        }
        if ((source.faces >> down & 1u) != 0u) is_absorbing[axis] = 1.0;
        else if (own[axis] == size[axis] - 1) is_leaving[axis] = 1.0;
    }

    vec4 sums[4] = vec4[4](vec4(0.0), vec4(0.0), vec4(0.0), vec4(0.0));
    ivec3 place = KEEP ? cell : ivec3(ab, int(params.step & 1u));
    int layers = KEEP ? size.z : 2, first_layer = slab * int(params.pair_count) * layers;
    uint first = octants[octant].x;
    uint end = min(octants[octant].y, params.first_pair + params.pair_count);
    for (uint k = params.first_pair; k < end; ++k) {
        int layer = first_layer + int(k - params.first_pair) * layers;
        Pair here = unpack(imageLoad(front, place + ivec3(0, 0, layer)));
        for (uint i = 0u; i < 2u; ++i) {
            Direction own = directions[2u * (first + k) + i];
            vec4 direction = own.travel, brought = with_sky(own, here.radiance[i]);
            vec3 steepness = abs(direction.xyz);
            vec4 started = vec4(max(direction.xyz * source.vectors, vec3(0.0)), 0.0);
            sums[INJECTED] += direction.w * (started + sent * steepness);
            sums[ENTERED] += direction.w * with_sky(own, inflow * steepness);
            sums[ABSORBED] += direction.w * dot(is_absorbing, steepness) * brought;
            sums[LEFT] += direction.w * dot(is_leaving, steepness) * brought;
        }
    }
    uint row = ENTRIES * (8u * gl_GlobalInvocationID.x + uint(slab));
    for (uint i = 0u; i < 4u; ++i) ledger[row + i] += sums[i];
}
