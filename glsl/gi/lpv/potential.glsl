// B(ω) = Σ A ⟨n,ω⟩₊ / h² in two bands, of x, y, z of Σ A n / h², then Σ A / h².
#ifndef LUMIVOX_LPV_POTENTIAL
#define LUMIVOX_LPV_POTENTIAL

#include "gi/shared/sh.glsl"

vec4 potential(vec4 share) {
    return vec4(SH_COSINE.x * SH_Y0 * share.w, SH_COSINE.y * SH_Y1 * share.yzx);
}

#endif
