#version 460
#extension GL_GOOGLE_include_directive : require
// lpv.lobe_ledger: where the light goes that cells send in one step of lpv.propagate, beside it:
// what enters through the border, what is stopped, and what leaves through the border, over h²
// [W/m²]; before the first step also what is injected, and after the last what is on its way. Alpha
// is the same of an environment of radiance 1.
layout(local_size_x = 8, local_size_y = 8) in;

layout(constant_id = 0) const uint SCHEME = 0u;
layout(constant_id = 1) const uint OCCLUSION = 0u;
layout(constant_id = 2) const bool CLAMP = false;   // no negative flux
layout(constant_id = 3) const bool LAST = false;    // all steps are done

const uint LOBES30 = 0u, AXIS6 = 1u, STREAM = 2u;
const uint NONE = 0u, FACES = 1u, FUZZY = 2u;

layout(std430, set = 1, binding = 0) restrict readonly buffer Faces { uint faces[]; };
layout(std430, set = 1, binding = 1) restrict readonly buffer Streams {
    mat4 outside_sent;
    mat4 streams[6];
};
layout(set = 1, binding = 2) uniform texture3D blockers;
layout(set = 1, binding = 3, rgba32ui) uniform restrict readonly uimage3D lobes;
// injected, entered, absorbed, left, on its way, of each cell
layout(std430, set = 1, binding = 4) restrict buffer Ledger { vec4 ledger[]; };

#include "shared/frame.glsl"
#include "gi/lpv/lobes.glsl"

layout(push_constant) uniform PropagateParams {
    CellGrid grid;
    uint step;      // from 1: the one that follows
    float gain;     // fraction of the flux that goes on
} params;

const float SOLID_FAR = 0.4006696846, SOLID_SIDE = 0.4234313544, SOLID_AXIS = 2.0943951024;
const uint ENTRIES = 5u;   // Rust: ENTRIES of lpv::ledger
const uint INJECTED = 0u, ENTERED = 1u, ABSORBED = 2u, LEFT = 3u, ON_ITS_WAY = 4u;

// Blocking potential at the middle of a face, as in lpv.propagate.
vec4 blocking_at(vec3 place) {
    if (OCCLUSION != FUZZY || params.step == 1u) return vec4(0.0);
    vec3 nodes = vec3(params.grid.size.xyz + 1);
    return textureLod(sampler3D(blockers, linear_clamp), (place + 0.5) / nodes, 0.0);
}

// Flux along a direction: x is what passes, y what is stopped, for all channels.
mat2x4 split(mat4 sent, vec4 blocking, vec3 direction, float solid) {
    vec4 flux = sent * sh_evaluate2(direction) * solid;
    if (CLAMP) flux = max(flux, vec4(0.0));
    float passing = 1.0 - clamp(dot(blocking, sh_evaluate2(-direction)), 0.0, 1.0);
    return mat2x4(passing * flux, (1.0 - passing) * flux);
}

// The same through a face, of all that is sent through it.
mat2x4 through(mat4 sent, vec4 blocking, uint face) {
    vec3 onwards = axis_direction(face);
    if (SCHEME == AXIS6) return split(sent, blocking, onwards, SOLID_AXIS);
    if (SCHEME == STREAM) {
        float passing = 1.0 - clamp(dot(blocking, sh_evaluate2(-onwards)), 0.0, 1.0);
        // The mean of a lobe's first coefficient over all directions.
        vec4 flux = (sent * streams[face ^ 1u])[0] / SH_Y0;
        return mat2x4(passing * flux, (1.0 - passing) * flux);
    }
    mat2x4 sum = split(sent, blocking, onwards, SOLID_FAR);
    for (uint other = 0u; other < 6u; ++other) {
        if (other >> 1 == face >> 1) continue;
        vec3 direction = normalize(onwards + 0.5 * axis_direction(other));
        sum += split(sent, blocking, direction, SOLID_SIDE);
    }
    return sum;
}

void main() {
    ivec3 cell = ivec3(gl_GlobalInvocationID);
    if (!is_inside(params.grid, cell)) return;
    int index = cell_index(params.grid, cell);
    uint row = ENTRIES * uint(index);
    mat4 sent = mat4(0.0), outside = mat4(0.0);
    for (int i = 0; i < 2; ++i)
        unpack(imageLoad(lobes, pair_texel(params.grid, cell, i, params.step - 1u)),
            sent[2 * i], sent[2 * i + 1]);
    vec4 here = sent[0] / SH_Y0;
    if (LAST) {
        ledger[row + ON_ITS_WAY] = here;
        return;
    }
    if (params.step == 1u) {
        ledger[row + INJECTED] = here;
        outside = outside_sent;
    }
    uint word = OCCLUSION == FACES ? faces[index] : 0u;
    for (uint face = 0u; face < 6u; ++face) {
        vec3 onwards = axis_direction(face);
        vec4 blocking = blocking_at(vec3(cell) + 0.5 + 0.5 * onwards);
        mat2x4 flux = params.gain * through(sent, blocking, face);
        bool is_opaque = (word >> face & 1u) != 0u;
        ledger[row + ABSORBED] += is_opaque ? flux[0] + flux[1] : flux[1];
        if (is_opaque || is_inside(params.grid, cell + ivec3(onwards))) continue;
        ledger[row + LEFT] += flux[0];
        ledger[row + ENTERED] += params.gain * through(outside, blocking, face ^ 1u)[0];
    }
}
