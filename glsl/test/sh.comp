// Every function of gi/shared/sh.glsl, a thread a case.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "gi/shared/sh.glsl"
layout(local_size_x = 32) in;

// Of a case: direction, two functions of 3 bands, columns of a rotation.
const uint GIVEN = 3u + 9u + 9u + 9u;
const uint MADE = 4u + 9u + 16u + 25u + 64u + 64u + 4u + 9u + 3u + 4u + 9u + 9u;

layout(set = 1, binding = 0, std430) restrict readonly buffer Cases { float cases[]; };
layout(set = 1, binding = 1, std430) restrict writeonly buffer Results { float results[]; };
layout(push_constant) uniform Params { uint count; } params;

vec3 vector(uint at) {
    return vec3(cases[at], cases[at + 1u], cases[at + 2u]);
}

void main() {
    uint index = gl_GlobalInvocationID.x;
    if (index >= params.count) return;
    uint at = index * GIVEN, to = index * MADE;
    vec3 d = vector(at);
    float a[9], b[9];
    for (uint i = 0u; i < 9u; i++) {
        a[i] = cases[at + 3u + i];
        b[i] = cases[at + 12u + i];
    }
    mat3 rotation = mat3(vector(at + 21u), vector(at + 24u), vector(at + 27u));

    vec4 basis2 = sh_evaluate2(d);
    for (int i = 0; i < 4; i++) results[to++] = basis2[i];
    float basis3[9] = sh_evaluate3(d);
    for (int i = 0; i < 9; i++) results[to++] = basis3[i];
    float basis4[16] = sh_evaluate4(d);
    for (int i = 0; i < 16; i++) results[to++] = basis4[i];
    float basis5[25] = sh_evaluate5(d);
    for (int i = 0; i < 25; i++) results[to++] = basis5[i];
    for (int few = 0; few < 2; few++) {
        float basis[64];
        for (int i = 0; i < 64; i++) basis[i] = 0.0;
        sh_evaluate(few == 0 ? SH_BANDS_MAX : 3u, d, basis);
        for (int i = 0; i < 64; i++) results[to++] = basis[i];
    }

    vec4 cosine = sh_cosine_lobe2(d);
    for (int i = 0; i < 4; i++) results[to++] = cosine[i];
    float zonal[9] = sh_zonal3(vec3(b[0], b[1], b[2]), d);
    for (int i = 0; i < 9; i++) results[to++] = zonal[i];
    vec3 radiance[9];
    for (int i = 0; i < 9; i++) radiance[i] = vec3(a[i], b[i], a[i] - b[i]);
    vec3 irradiance = sh_irradiance3(radiance, d);
    for (int i = 0; i < 3; i++) results[to++] = irradiance[i];
    vec4 product2 = sh_product2(vec4(a[0], a[1], a[2], a[3]), vec4(b[0], b[1], b[2], b[3]));
    for (int i = 0; i < 4; i++) results[to++] = product2[i];
    float product3[9] = sh_product3(a, b);
    for (int i = 0; i < 9; i++) results[to++] = product3[i];
    float turned[9] = sh_rotate3(a, rotation);
    for (int i = 0; i < 9; i++) results[to++] = turned[i];
}
