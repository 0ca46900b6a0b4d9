// Real spherical harmonics of three bands without the Condon–Shortley phase, in the order l² + l +
// m (Ramamoorthi & Hanrahan 2001).
#ifndef LUMIVOX_LPV_SH
#define LUMIVOX_LPV_SH

const int COEFFICIENTS = 9;
// of coefficients that share a texel; the last has one
const int COEFFICIENT_PAIRS = 5;

void sh_basis(vec3 d, out float y[COEFFICIENTS]) {
    y[0] = 0.28209479;
    y[1] = 0.48860251 * d.y;
    y[2] = 0.48860251 * d.z;
    y[3] = 0.48860251 * d.x;
    y[4] = 1.09254843 * d.x * d.y;
    y[5] = 1.09254843 * d.y * d.z;
    y[6] = 0.31539157 * (3.0 * d.z * d.z - 1.0);
    y[7] = 1.09254843 * d.x * d.z;
    y[8] = 0.54627422 * (d.x * d.x - d.y * d.y);
}

int sh_band(int coefficient) {
    return coefficient == 0 ? 0 : coefficient < 4 ? 1 : 2;
}

// E(n) = Σ A_l c_lm Y_lm(n), A = π, 2π/3, π/4 (Ramamoorthi & Hanrahan 2001, equations 4 and 8).
vec4 sh_irradiance(vec4 coefficients[COEFFICIENTS], vec3 normal) {
    const float FULL = 3.14159265358979;
    float basis[COEFFICIENTS];
    sh_basis(normal, basis);
    vec4 sum = vec4(0.0);
    for (int i = 0; i < COEFFICIENTS; ++i) {
        float weight = i == 0 ? FULL : i < 4 ? 2.0 / 3.0 * FULL : 0.25 * FULL;
        sum += weight * basis[i] * coefficients[i];
    }
    return max(sum, vec4(0.0));
}

#endif
