// What is in the way of lobes. The including pass declares `blockers`, `OCCLUSION`, and push
// constants `params` with `grid` and `step`, and includes shared/frame.glsl before.
#ifndef LUMIVOX_LPV_BLOCKING
#define LUMIVOX_LPV_BLOCKING

#include "gi/shared/sh.glsl"

const uint NONE = 0u, FACES = 1u, FUZZY = 2u;

// Blocking potential at the middle of a face; no light was blocked before the first step.
vec4 blocking_at(vec3 place) {
    if (OCCLUSION != FUZZY || params.step == 1u) return vec4(0.0);
    vec3 nodes = vec3(params.grid.size.xyz + 1);
    return textureLod(sampler3D(blockers, linear_clamp), (place + 0.5) / nodes, 0.0);
}

float passing(vec4 blocking, vec3 direction) {
    return 1.0 - clamp(dot(blocking, sh_evaluate2(-direction)), 0.0, 1.0);
}

#endif
