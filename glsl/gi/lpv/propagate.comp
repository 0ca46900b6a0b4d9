#version 460
#extension GL_GOOGLE_include_directive : require
// lpv.propagate: one step of all cells at once. A cell takes what its six neighbours have sent in
// the step before, and the sum of all steps grows by it.
//
// 30 lobes (Kaplanyan & Dachsbacher 2010): a neighbour lights the five other faces of this cell.
// The flux through a face is Φ = Ω I(ω), with ω from the neighbour's centre to the face's. It
// becomes a lobe towards the face, whose peak is Φ/π.
// Axis (Kaplanyan 2009): one flux a neighbour along the axis, Ω = 2π/3, and one lobe.
// Stream: a neighbour passes on the fraction max(0, ω·d)/(|ωx| + |ωy| + |ωz|) along d.
//
// Outside of the grid the first step has the environment, and the others have nothing: the sum of
// all steps is of light that came in once.
layout(local_size_x = 8, local_size_y = 8) in;

layout(constant_id = 0) const uint SCHEME = 0u;
layout(constant_id = 1) const uint OCCLUSION = 0u;
layout(constant_id = 2) const bool CLAMP = false;   // no negative flux

const uint LOBES30 = 0u, AXIS6 = 1u, STREAM = 2u;

layout(std430, set = 1, binding = 0) restrict readonly buffer Faces { uint faces[]; };
layout(std430, set = 1, binding = 1) restrict readonly buffer Streams {
    mat4 outside;        // what comes from the environment, for each face
    mat4 streams[6];     // of the faces −x, +x, −y, …: what goes towards the cell
};
layout(set = 1, binding = 2) uniform texture3D blockers;
layout(set = 1, binding = 3, rgba32ui) uniform restrict uimage3D lobes;
layout(set = 1, binding = 4, rgba32f) uniform restrict image3D sum;

#include "shared/frame.glsl"
#include "gi/lpv/lobes.glsl"

layout(push_constant) uniform PropagateParams {
    CellGrid grid;
    uint step;      // from 1
    float gain;     // fraction of the flux that goes on
} params;

// Solid angles of a face, seen from the centre of the cell before: far and side, [sr]. Five of them
// on six sides are the sphere: 6 (Ω_far + 4 Ω_side) = 4π.
const float SOLID_FAR = 0.4006696846, SOLID_SIDE = 0.4234313544, SOLID_AXIS = 2.0943951024;

mat4 sent_by(ivec3 neighbour) {
    mat4 sent = mat4(0.0);
    if (is_inside(params.grid, neighbour)) {
        for (int i = 0; i < 2; ++i) {
            uvec4 words =
                imageLoad(lobes, pair_texel(params.grid, neighbour, i, params.step - 1u));
            unpack(words, sent[2 * i], sent[2 * i + 1]);
        }
    } else if (params.step == 1u) {
        sent = outside;
    }
    return sent;
}

#include "gi/lpv/blocking.glsl"

// A lobe towards `face`, from what goes along `direction` within `solid` [sr].
mat4 lobe(mat4 sent, vec4 blocking, vec3 direction, vec3 face, float solid) {
    vec4 flux = sent * sh_evaluate2(direction) * solid;
    if (CLAMP) flux = max(flux, vec4(0.0));
    return outerProduct(flux * passing(blocking, direction) / PI, sh_cosine_lobe2(face));
}

void main() {
    ivec3 cell = ivec3(gl_GlobalInvocationID);
    if (!is_inside(params.grid, cell)) return;
    uint word = OCCLUSION == FACES ? faces[cell_index(params.grid, cell)] : 0u;
    mat4 arrived = mat4(0.0);
    for (uint face = 0u; face < 6u; ++face) {
        if ((word >> face & 1u) != 0u) continue;
        vec3 onwards = -axis_direction(face);
        mat4 sent = sent_by(cell - ivec3(onwards));
        vec4 blocking = blocking_at(vec3(cell) + 0.5 - 0.5 * onwards);
        if (SCHEME == STREAM) {
            arrived += passing(blocking, onwards) * sent * streams[face];
        } else if (SCHEME == AXIS6) {
            arrived += lobe(sent, blocking, onwards, onwards, SOLID_AXIS);
        } else {
            arrived += lobe(sent, blocking, onwards, onwards, SOLID_FAR);
            for (uint other = 0u; other < 6u; ++other) {
                if (other >> 1 == face >> 1) continue;
                vec3 side = axis_direction(other);
                arrived +=
                    lobe(sent, blocking, normalize(onwards + 0.5 * side), side, SOLID_SIDE);
            }
        }
    }
    arrived *= params.gain;
    for (int i = 0; i < 2; ++i)
        imageStore(lobes, pair_texel(params.grid, cell, i, params.step),
            pack(arrived[2 * i], arrived[2 * i + 1]));
    for (int i = 0; i < LOBE_COEFFICIENTS; ++i) {
        ivec3 texel = sum_texel(params.grid, cell, i);
        imageStore(sum, texel, imageLoad(sum, texel) + arrived[i]);
    }
}
