// Normals of surfaces that have moved, as they were in the frame before.
#ifndef LUMIVOX_TURNED
#define LUMIVOX_TURNED

#include "shared/packing.glsl"

// A unit vector in 24 bits, as a whole number from 1 on that a float holds.
float pack_turned(vec3 n) {
    uvec2 bits = uvec2(round((octahedral_from_unit(n) * 0.5 + 0.5) * 4095.0));
    return float((bits.x | bits.y << 12) + 1u);
}

vec3 unpack_turned(float packed) {
    uint bits = uint(packed) - 1u;
    return unit_from_octahedral(vec2(bits & 4095u, bits >> 12) / 4095.0 * 2.0 - 1.0);
}

// `v`, turned by the smallest angle that turns the unit vector `from` to `to`, which is not its
// opposite.
vec3 rotated(vec3 from, vec3 to, vec3 v) {
    vec3 axis = cross(from, to);
    float cosine = dot(from, to);
    return v * cosine + cross(axis, v) + axis * (dot(axis, v) / (1.0 + cosine));
}

#endif
