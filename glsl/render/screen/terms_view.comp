#version 460
#extension GL_GOOGLE_include_directive : require
// render.terms_view: some of the terms of L = L_e + L_direct + ρ/π · E_i + L_s.
layout(local_size_x = 8, local_size_y = 8) in;

layout(constant_id = 0) const uint SPECULAR = 0;

layout(set = 1, binding = 0) uniform texture2D direct;
layout(set = 1, binding = 1) uniform texture2D indirect;
layout(set = 1, binding = 2) uniform texture2D radiance;
layout(set = 1, binding = 3) uniform texture2D indirect_specular;
layout(set = 1, binding = 4) uniform texture2D indirect_diffuse;
layout(set = 1, binding = 5, rgba32f) uniform restrict writeonly image2D shown;

#include "shared/frame.glsl"

layout(push_constant) uniform TermsParams {
    uint terms;
} params;

const uint DIRECT = 1u, DIFFUSE = 2u, SPECULAR_TERM = 4u, EMISSION = 8u, VISIBILITY = 16u;
const uint ALL = DIRECT | DIFFUSE | SPECULAR_TERM | EMISSION;

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, ivec2(frame.size_px.xy)))) return;
    vec4 all = texelFetch(sampler2D(radiance, nearest_clamp), pixel, 0);
    vec3 once = texelFetch(sampler2D(direct, nearest_clamp), pixel, 0).rgb;
    vec3 reflected = texelFetch(sampler2D(indirect, nearest_clamp), pixel, 0).rgb;
    vec3 mirrored = SPECULAR != 0u
        ? texelFetch(sampler2D(indirect_specular, nearest_clamp), pixel, 0).rgb : vec3(0.0);
    // In the order in which the host sums them up, to the bit.
    precise vec3 sum = vec3(0.0);
    if ((params.terms & ALL) == ALL) {
        sum = all.rgb;
    } else {
        bool diffuse = (params.terms & DIFFUSE) != 0u;
        bool specular = (params.terms & SPECULAR_TERM) != 0u;
        if ((params.terms & DIRECT) != 0u) sum += once;
        if (diffuse) sum += reflected;
        if (diffuse != specular) sum += specular ? mirrored : -mirrored;
        precise vec3 emitted = all.rgb - once - reflected;
        if ((params.terms & EMISSION) != 0u) sum += emitted;
    }
    if ((params.terms & VISIBILITY) != 0u && all.a > 0.0)
        sum *= texelFetch(sampler2D(indirect_diffuse, nearest_clamp), pixel, 0).a;
    imageStore(shown, pixel, vec4(sum, all.a));
}
