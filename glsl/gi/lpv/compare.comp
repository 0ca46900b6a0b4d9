#version 460
#extension GL_GOOGLE_include_directive : require
// lpv.compare: whether what opaque faces send has changed so much since the bounce before that
// there is another one. One workgroup.
layout(local_size_x = 256) in;

layout(std430, set = 1, binding = 0) restrict readonly buffer Changes {
    uvec4 changes[];   // of each workgroup of lpv.light_sides: Σ|change|, Σ
};
layout(std430, set = 1, binding = 1) restrict writeonly buffer GoesOn { uint goes_on; };

layout(push_constant) uniform CompareParams {
    uint sum_count;
    float least_change;   // over the whole
} params;

#include "gi/lpv/changes.glsl"

shared uvec4 sums[256];

void main() {
    uint own = gl_LocalInvocationID.x;
    uvec4 sum = uvec4(0u);
    for (uint i = own; i < params.sum_count; i += 256u) sum = sum_of(sum, changes[i]);
    sums[own] = sum;
    barrier();
    for (uint half_count = 128u; half_count > 0u; half_count /= 2u) {
        if (own < half_count) sums[own] = sum_of(sums[own], sums[own + half_count]);
        barrier();
    }
    if (own > 0u) return;
    vec2 found = vec2(sums[0].yw) * 4294967296.0 + vec2(sums[0].xz);
    goes_on = uint(found.x > params.least_change * found.y);
}
