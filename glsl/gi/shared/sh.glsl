// Real spherical harmonics: the twin of src/gi/shared/sh, whose module has the one convention.
// Y_lm has the place l² + l + m; no sign (−1)^m: Y_1 = √(3/4π) (y, z, x). Directions have length 1.
// sh_*2 and sh_*3 are for 2 and 3 bands. Equations: docs/gi/spherical_harmonics.md.
#ifndef LUMIVOX_SH
#define LUMIVOX_SH

const float SH_Y0 = 0.28209479177387814;   // √(1/4π)
const float SH_Y1 = 0.48860251190291992;   // √(3/4π)
// Factors of bands 0, 1 and 2 by which radiance becomes irradiance: π, 2π/3, π/4.
const vec3 SH_COSINE = vec3(3.14159265358979324, 2.09439510239319549, 0.78539816339744831);
const uint SH_BANDS_MAX = 8u;

float[5] sh_band2(vec3 d) {
    return float[](
        1.09254843059207907 * d.x * d.y,
        1.09254843059207907 * d.y * d.z,
        0.31539156525252001 * (3.0 * d.z * d.z - 1.0),
        1.09254843059207907 * d.x * d.z,
        0.54627421529603954 * (d.x * d.x - d.y * d.y));
}

float[7] sh_band3(vec3 d) {
    vec3 s = d * d;
    return float[](
        0.59004358992664351 * d.y * (3.0 * s.x - s.y),
        2.89061144264055406 * d.x * d.y * d.z,
        0.45704579946446577 * d.y * (5.0 * s.z - 1.0),
        0.37317633259011540 * d.z * (5.0 * s.z - 3.0),
        0.45704579946446577 * d.x * (5.0 * s.z - 1.0),
        1.44530572132027703 * d.z * (s.x - s.y),
        0.59004358992664351 * d.x * (s.x - 3.0 * s.y));
}

float[9] sh_band4(vec3 d) {
    vec3 s = d * d;
    return float[](
        2.50334294179670454 * d.x * d.y * (s.x - s.y),
        1.77013076977993053 * d.y * d.z * (3.0 * s.x - s.y),
        0.94617469575756002 * d.x * d.y * (7.0 * s.z - 1.0),
        0.66904654355728917 * d.y * d.z * (7.0 * s.z - 3.0),
        0.10578554691520431 * (s.z * (35.0 * s.z - 30.0) + 3.0),
        0.66904654355728917 * d.x * d.z * (7.0 * s.z - 3.0),
        0.47308734787878001 * (s.x - s.y) * (7.0 * s.z - 1.0),
        1.77013076977993053 * d.x * d.z * (s.x - 3.0 * s.y),
        0.62583573544917613 * (s.x * (s.x - 3.0 * s.y) - s.y * (3.0 * s.x - s.y)));
}

// The basis of 2 bands.
vec4 sh_evaluate2(vec3 d) {
    return vec4(SH_Y0, SH_Y1 * d.yzx);
}

// The basis of 3 bands.
float[9] sh_evaluate3(vec3 d) {
    vec3 first = SH_Y1 * d.yzx;
    float second[5] = sh_band2(d);
    return float[](SH_Y0, first.x, first.y, first.z,
        second[0], second[1], second[2], second[3], second[4]);
}

// The basis of 4 bands.
float[16] sh_evaluate4(vec3 d) {
    float low[9] = sh_evaluate3(d), high[7] = sh_band3(d), all[16];
    for (int i = 0; i < 9; i++) all[i] = low[i];
    for (int i = 0; i < 7; i++) all[9 + i] = high[i];
    return all;
}

// The basis of 5 bands.
float[25] sh_evaluate5(vec3 d) {
    float low[16] = sh_evaluate4(d), high[9] = sh_band4(d), all[25];
    for (int i = 0; i < 16; i++) all[i] = low[i];
    for (int i = 0; i < 9; i++) all[16 + i] = high[i];
    return all;
}

// Of the recurrence of normalised P_lm.
float sh_ratio(uint l, uint m) {
    return sqrt(float(l * l - m * m) / (4.0 * float(l * l) - 1.0));
}

// The basis of up to SH_BANDS_MAX bands, by the host's recurrence; other places stay as they are.
void sh_evaluate(uint bands, vec3 d, inout float values[64]) {
    float cosine = 1.0, sine = 0.0, first = SH_Y0;
    for (uint m = 0u; m < min(bands, SH_BANDS_MAX); m++) {
        float before = 0.0, polynomial = first;
        for (uint l = m; l < min(bands, SH_BANDS_MAX); l++) {
            uint middle = l * l + l;
            if (m > 0u) values[middle - m] = polynomial * sine;
            values[middle + m] = polynomial * cosine;
            float next = (d.z * polynomial - sh_ratio(l, m) * before) / sh_ratio(l + 1u, m);
            before = polynomial;
            polynomial = next;
        }
        float turned = d.x * cosine - d.y * sine;
        sine = d.x * sine + d.y * cosine;
        cosine = turned;
        float odd = float(2u * m + 1u);
        first *= sqrt((odd + 2.0) / (odd + 1.0) * (m == 0u ? 2.0 : 1.0));
    }
}

// One function of the basis, of any band.
float sh_harmonic(uint l, int m, vec3 d) {
    uint order = uint(abs(m));
    float cosine = 1.0, sine = 0.0, first = SH_Y0;
    for (uint i = 0u; i < order; i++) {
        float turned = d.x * cosine - d.y * sine;
        sine = d.x * sine + d.y * cosine;
        cosine = turned;
        float odd = float(2u * i + 1u);
        first *= sqrt((odd + 2.0) / (odd + 1.0) * (i == 0u ? 2.0 : 1.0));
    }
    float before = 0.0, polynomial = first;
    for (uint i = order; i < l; i++) {
        float next = (d.z * polynomial - (i == order ? 0.0 : sh_ratio(i, order)) * before)
            / sh_ratio(i + 1u, order);
        before = polynomial;
        polynomial = next;
    }
    return polynomial * (m < 0 ? sine : cosine);
}

// The clamped cosine about a direction: (√π/2, √(π/3) d).
vec4 sh_cosine_lobe2(vec3 d) {
    return vec4(SH_COSINE.x * SH_Y0, SH_COSINE.y * SH_Y1 * d.yzx);
}

// A lobe about a direction, by its factor of each band.
float[9] sh_zonal3(vec3 lobe, vec3 d) {
    float values[9] = sh_evaluate3(d);
    values[0] *= lobe.x;
    for (int i = 1; i < 4; i++) values[i] *= lobe.y;
    for (int i = 4; i < 9; i++) values[i] *= lobe.z;
    return values;
}

// Irradiance of a surface, not clamped [W/m²]; radiance by the direction that it comes from.
vec3 sh_irradiance3(vec3 radiance[9], vec3 normal) {
    float lobe[9] = sh_zonal3(SH_COSINE, normal);
    vec3 sum = vec3(0.0);
    for (int i = 0; i < 9; i++) sum += lobe[i] * radiance[i];
    return sum;
}

// The product of two functions, cut off at 2 bands.
vec4 sh_product2(vec4 a, vec4 b) {
    return SH_Y0 * vec4(dot(a, b), a.x * b.yzw + b.x * a.yzw);
}

// 3 bands as mean + linear·d + d·quadratic d; the matrix is symmetric, its trace 0.
struct ShTensor {
    float mean;
    vec3 linear;
    mat3 quadratic;
};

const float SH_XY = 0.54627421529603954;   // half the factor of xy, yz and xz
const float SH_ZZ = 0.31539156525252001;   // of 3z² − 1

ShTensor sh_tensor(float c[9]) {
    float xy = SH_XY * c[4], yz = SH_XY * c[5], xz = SH_XY * c[7];
    float zz = SH_ZZ * c[6], difference = SH_XY * c[8];
    return ShTensor(SH_Y0 * c[0], SH_Y1 * vec3(c[3], c[1], c[2]),
        mat3(difference - zz, xy, xz, xy, -difference - zz, yz, xz, yz, 2.0 * zz));
}

float[9] sh_coefficients(ShTensor t) {
    vec3 linear = t.linear.yzx / SH_Y1;
    mat3 m = t.quadratic;
    return float[](t.mean / SH_Y0, linear.x, linear.y, linear.z,
        m[0][1] / SH_XY, m[1][2] / SH_XY, 0.5 * m[2][2] / SH_ZZ, m[0][2] / SH_XY,
        0.5 * (m[0][0] - m[1][1]) / SH_XY);
}

// The product of two functions, cut off at 3 bands.
float[9] sh_product3(float a[9], float b[9]) {
    ShTensor f = sh_tensor(a), g = sh_tensor(b);
    mat3 m = f.quadratic, n = g.quadratic, both = m * n;
    float trace = both[0][0] + both[1][1] + both[2][2];
    float along = dot(f.linear, g.linear);
    ShTensor t;
    t.mean = f.mean * g.mean + along / 3.0 + trace * (2.0 / 15.0);
    t.linear = f.mean * g.linear + g.mean * f.linear + 0.4 * (n * f.linear + m * g.linear);
    mat3 outer = outerProduct(f.linear, g.linear);
    t.quadratic = f.mean * n + g.mean * m + 0.5 * (outer + transpose(outer))
        + (2.0 / 7.0) * (both + transpose(both))
        - mat3(along / 3.0 + trace * (4.0 / 21.0));
    return sh_coefficients(t);
}

// The function turned with a rotation: f'(R d) = f(d).
float[9] sh_rotate3(float c[9], mat3 rotation) {
    ShTensor t = sh_tensor(c);
    t.linear = rotation * t.linear;
    t.quadratic = rotation * t.quadratic * transpose(rotation);
    return sh_coefficients(t);
}

#endif
