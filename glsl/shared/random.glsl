// Random numbers from three integers (Jarzynski & Olano 2020).
#ifndef LUMIVOX_RANDOM
#define LUMIVOX_RANDOM

uvec3 pcg3(uvec3 v) {
    v = v * 1664525u + 1013904223u;
    v.x += v.y * v.z;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    v ^= v >> 16;
    v.x += v.y * v.z;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    return v;
}

// Of [0, 1).
vec3 unit_numbers(uvec3 v) {
    return vec3(v >> 8) * (1.0 / 16777216.0);
}

#endif
