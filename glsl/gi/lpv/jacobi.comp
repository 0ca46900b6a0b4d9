#version 460
#extension GL_GOOGLE_include_directive : require
// lpv.jacobi: one step of all cells at once, for some pairs of directions. A cell takes what its
// three upwind neighbours have had after the step before, of which there was none before the first:
//
//   L = (|ωx| Lx + |ωy| Ly + |ωz| Lz + Q) / (|ωx| + |ωy| + |ωz|),  Q = max(0, F·ω) / (π h²)
//
// All else is as in lpv.sweep, to which the steps come once they are as many as a path has cells.
layout(local_size_x = 8, local_size_y = 8) in;

#include "gi/lpv/directions.glsl"
#include "gi/lpv/grid.glsl"
#include "gi/lpv/pairs.glsl"

layout(constant_id = 0) const bool SIDES = false;   // opaque faces send light

layout(std430, set = 1, binding = 0) restrict readonly buffer Directions {
    uvec4 octants[8];
    Direction directions[];
};
layout(set = 1, binding = 1, rgba32ui) uniform restrict readonly uimage3D sources;
// radiance; z: parity of the step, pair of directions, z of the cell
layout(set = 1, binding = 2, rgba32ui) uniform restrict uimage3D fields;
layout(std430, set = 1, binding = 3) restrict readonly buffer SideLight { vec4 side_light[]; };
layout(set = 1, binding = 4, rgba16ui) uniform restrict readonly uimage3D source_faces;

layout(push_constant) uniform JacobiParams {
    CellGrid grid;       // size.w: pairs of directions that a half of the volume has room for
    uint first_pair;
    uint pair_count;
    uint step;           // from 1
} params;

#include "gi/lpv/sources.glsl"

ivec3 field_texel(ivec3 cell, int pair, uint step) {
    int half_of_volume = int(step & 1u) * params.grid.size.w;
    return cell + ivec3(0, 0, (half_of_volume + pair) * params.grid.size.z);
}

void main() {
    ivec3 size = params.grid.size.xyz, cell = ivec3(gl_GlobalInvocationID);
    int k = cell.z / size.z;
    cell.z -= k * size.z;
    if (!is_inside(params.grid, cell)) return;
    uint first = 2u * (params.first_pair + uint(k));
    vec3 pair[2] = vec3[2](directions[first].travel.xyz, directions[first + 1u].travel.xyz);
    CellSource found = load_source(cell);
    Pair here;
    for (int i = 0; i < 2; ++i)
        here.radiance[i] = vec4(max(pair[i] * found.vectors, vec3(0.0)), 0.0);
    for (int axis = 0; axis < 3; ++axis) {
        // Both of a pair are of one octant, and no direction lies along an axis.
        bool is_reversed = pair[0][axis] < 0.0;
        uint face = 2u * uint(axis) + uint(is_reversed);
        ivec3 next = cell;
        next[axis] += is_reversed ? 1 : -1;
        Pair arriving = Pair(vec4[2](vec4(0.0), vec4(0.0)));
        if ((found.faces >> face & 1u) != 0u) {
            if (SIDES) {
                vec4 side = side_light[side_of(found.faces, face)];
                arriving = Pair(vec4[2](side, side));
            }
        } else if (!is_inside(params.grid, next)) {
            arriving = Pair(vec4[2](vec4(0.0, 0.0, 0.0, 1.0), vec4(0.0, 0.0, 0.0, 1.0)));
        } else if (params.step > 1u) {
            arriving = unpack(imageLoad(fields, field_texel(next, k, params.step - 1u)));
        }
        for (int i = 0; i < 2; ++i)
            here.radiance[i] += abs(pair[i][axis]) * arriving.radiance[i];
    }
    for (int i = 0; i < 2; ++i) {
        vec3 steepness = abs(pair[i]);
        here.radiance[i] /= steepness.x + steepness.y + steepness.z;
    }
    imageStore(fields, field_texel(cell, k, params.step), pack(here));
}
