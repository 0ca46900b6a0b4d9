#version 460
#extension GL_GOOGLE_include_directive : require
// lpv.slices: one slice of cells, for all directions of some groups. A group has the directions of
// one octant that are steepest along one axis, a; b and c are the axes after it. Slices are
// perpendicular to a, and each needs the one before it alone.
//
// With u = |ωb|/|ωa| and v = |ωc|/|ωa| in [0, 1], the point that light comes from is among four
// cells of the slice before, by (1, 0, 0), (1, 1, 0), (1, 0, 1), (1, 1, 1) along a, b, c upwind:
//
//   L = (1−u)(1−v) L₁₀₀ + u(1−v) L₁₁₀ + (1−u)v L₁₀₁ + uv L₁₁₁ + Q/|ωa|
//
// Only neighbours know of opaque faces. So light comes from a cell by paths of steps to neighbours,
// one along each axis that they differ in, in any order: 1, 2, 2 and 6 paths, and each has an equal
// part. A path ends at the first opaque face, seen from the end, with the light of that face, and
// at the grid's border with that of the environment. So nothing passes a wall.
layout(local_size_x = 64) in;

#include "gi/lpv/directions.glsl"
#include "gi/lpv/grid.glsl"
#include "gi/lpv/harmonics.glsl"
#include "gi/lpv/pairs.glsl"

layout(constant_id = 0) const bool ADD = false;     // to what other groups have left
layout(constant_id = 1) const bool SIDES = false;   // opaque faces send light

layout(std430, set = 1, binding = 0) restrict readonly buffer Directions {
    uvec4 groups[24];      // x: first pair of directions; y: how many; z: axis; w: octant
    Direction directions[];
};
layout(set = 1, binding = 1, rgba32ui) uniform restrict readonly uimage3D sources;
// radiance of this slice and the one before: x, y: cell along b and c in the octant's own order; z:
// group, pair of directions, parity of the slice
layout(set = 1, binding = 2, rgba32ui) uniform restrict uimage3D front;
// sums over the directions of a group: x: pair of coefficients and x of the cell; z: group, z
layout(set = 1, binding = 3, rgba32ui) uniform restrict uimage3D slabs;
layout(std430, set = 1, binding = 4) restrict readonly buffer SideLight { vec4 side_light[]; };
layout(set = 1, binding = 5, rgba16ui) uniform restrict readonly uimage3D source_faces;

layout(push_constant) uniform SlicesParams {
    CellGrid grid;      // size.w: pairs of directions that a group has at most
    uint slice;
    uint first_group;
} params;

#include "gi/lpv/sources.glsl"

// Bits of a corner of the cube of eight cells: a cell further upwind along a, b, c.
const uint A = 1u, B = 2u, C = 4u;

struct Step { float open; vec4 light; };

// Of one step upwind from a cell: whether there is a cell, or else what light comes.
Step step_from(ivec3 cell, bool is_inside_grid, int axis, bool is_reversed) {
    if (!is_inside_grid) return Step(0.0, vec4(0.0, 0.0, 0.0, 1.0));
    uint word = load_faces(cell), face = 2u * uint(axis) + uint(is_reversed);
    if ((word >> face & 1u) != 0u) {
        vec4 light = vec4(0.0);
        if (SIDES) light = side_light[side_of(word, face)];
        return Step(0.0, light);
    }
    int edge = is_reversed ? params.grid.size[axis] - 1 : 0;
    return cell[axis] == edge ? Step(0.0, vec4(0.0, 0.0, 0.0, 1.0)) : Step(1.0, vec4(0.0));
}

// A path goes on from where a step ends.
Step on(Step step, Step rest) {
    return Step(step.open * rest.open, step.light + step.open * rest.light);
}

Step mean2(Step x, Step y) {
    return Step(0.5 * (x.open + y.open), 0.5 * (x.light + y.light));
}

void main() {
    ivec3 size = params.grid.size.xyz;
    int slab = int(gl_GlobalInvocationID.y);
    uvec4 group = groups[params.first_group + uint(slab)];
    int a = int(group.z), b = (a + 1) % 3, c = (a + 2) % 3;
    ivec2 bc = ivec2(gl_GlobalInvocationID.x % uint(size[b]), gl_GlobalInvocationID.x / size[b]);
    if (int(params.slice) >= size[a] || bc.y >= size[c]) return;
    bvec3 is_reversed =
        bvec3((group.w & 1u) != 0u, (group.w & 2u) != 0u, (group.w & 4u) != 0u);
    ivec3 own;
    own[a] = int(params.slice);
    own[b] = bc.x;
    own[c] = bc.y;
    ivec3 cell = mix(own, size - 1 - own, is_reversed);
    CellSource found = load_source(cell);

    // All steps along the edges of the cube of eight cells: by the corner they start at, and axis.
    Step steps[24];
    for (uint corner = 0u; corner < 7u; ++corner) {
        ivec3 up = ivec3(0);
        up[a] = int(corner & 1u);
        up[b] = int(corner >> 1 & 1u);
        up[c] = int(corner >> 2);
        ivec3 place = own - up, start = mix(place, size - 1 - place, is_reversed);
        bool is_there = all(greaterThanEqual(place, ivec3(0)));
        for (uint i = 0u; i < 3u; ++i) {
            int axis = (a + int(i)) % 3;
            if ((corner >> i & 1u) == 0u)
                steps[3u * corner + i] = step_from(start, is_there, axis, is_reversed[axis]);
        }
    }
    // Paths from a corner to the one after it by two steps, and all of the way.
    Step ab = mean2(on(steps[0], steps[3u * A + 1u]), on(steps[1], steps[3u * B])),
         ac = mean2(on(steps[0], steps[3u * A + 2u]), on(steps[2], steps[3u * C])),
         bc_after_a = mean2(on(steps[3u * A + 1u], steps[3u * (A | B) + 2u]),
             on(steps[3u * A + 2u], steps[3u * (A | C) + 1u])),
         ac_after_b = mean2(on(steps[3u * B], steps[3u * (A | B) + 2u]),
             on(steps[3u * B + 2u], steps[3u * (B | C)])),
         ab_after_c = mean2(on(steps[3u * C], steps[3u * (A | C) + 1u]),
             on(steps[3u * C + 1u], steps[3u * (B | C)]));
    Step by_a = on(steps[0], bc_after_a), by_b = on(steps[1], ac_after_b),
         by_c = on(steps[2], ab_after_c);
    Step from[4] = Step[4](steps[0], ab, ac,
        Step((by_a.open + by_b.open + by_c.open) / 3.0,
            (by_a.light + by_b.light + by_c.light) / 3.0));

    vec4 sums[COEFFICIENTS + 1];
    for (int i = 0; i <= COEFFICIENTS; ++i) sums[i] = vec4(0.0);
    int parity = int(params.slice & 1u);
    for (uint k = 0u; k < group.y; ++k) {
        int layer = 2 * (slab * params.grid.size.w + int(k));
        Direction both[2] = Direction[2](
            directions[2u * (group.x + k)], directions[2u * (group.x + k) + 1u]);
        vec4 pair[2] = vec4[2](both[0].travel, both[1].travel);
        Pair here;
        for (int i = 0; i < 2; ++i) {
            vec3 sent = max(pair[i].xyz * found.vectors, vec3(0.0));
            here.radiance[i] = vec4(sent, 0.0) / abs(pair[i][a]);
        }
        for (int n = 0; n < 4; ++n) {
            ivec2 up = ivec2(n & 1, n >> 1);
            Pair there = Pair(vec4[2](vec4(0.0), vec4(0.0)));
            if (from[n].open > 0.0)
                there = unpack(imageLoad(front, ivec3(bc - up, layer + 1 - parity)));
            for (int i = 0; i < 2; ++i) {
                vec2 across = abs(vec2(pair[i][b], pair[i][c])) / abs(pair[i][a]);
                vec2 shares = mix(1.0 - across, across, equal(up, ivec2(1)));
                here.radiance[i] += shares.x * shares.y
                    * (from[n].open * there.radiance[i] + from[n].light);
            }
        }
        for (int i = 0; i < 2; ++i) {
            float basis[COEFFICIENTS] = sh_evaluate3(-pair[i].xyz);
            vec4 weighted = pair[i].w * with_sky(both[i], here.radiance[i]);
            for (int j = 0; j < COEFFICIENTS; ++j) sums[j] += basis[j] * weighted;
        }
        imageStore(front, ivec3(bc, layer + parity), pack(here));
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
