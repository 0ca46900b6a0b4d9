// Small numbers in few bits.
#ifndef LUMIVOX_PACKING
#define LUMIVOX_PACKING

const float LARGEST_HALF = 65504.0;

// Octahedral map of the unit sphere onto [-1, 1]² (Meyer et al. 2010).
vec2 octahedral_from_unit(vec3 n) {
    vec2 p = n.xy / (abs(n.x) + abs(n.y) + abs(n.z));
    vec2 folded = (1.0 - abs(p.yx)) * vec2(p.x >= 0.0 ? 1.0 : -1.0, p.y >= 0.0 ? 1.0 : -1.0);
    return n.z >= 0.0 ? p : folded;
}

// Its direction, not of unit length.
vec3 direction_from_octahedral(vec2 p) {
    vec3 n = vec3(p, 1.0 - abs(p.x) - abs(p.y));
    float fold = max(-n.z, 0.0);
    n.xy += vec2(n.x >= 0.0 ? -fold : fold, n.y >= 0.0 ? -fold : fold);
    return n;
}

vec3 unit_from_octahedral(vec2 p) {
    return normalize(direction_from_octahedral(p));
}

uint pack_unit(vec3 n) {
    return packSnorm2x16(octahedral_from_unit(n));
}

vec3 unpack_unit(uint packed) {
    return unit_from_octahedral(unpackSnorm2x16(packed));
}

// Three numbers of [0, 1], 10 bits each.
uint pack_unorm10(vec3 v) {
    uvec3 q = uvec3(round(clamp(v, 0.0, 1.0) * 1023.0));
    return q.x | q.y << 10 | q.z << 20;
}

// Three numbers of 0 or more, 8 bits each, times a power of two that they share (Ward 1991).
uint pack_rgbe(vec3 v) {
    float most = max(v.r, max(v.g, v.b));
    if (!(most > 1e-30)) return 0u;
    int exponent;
    frexp(most, exponent);
    if (round(ldexp(most, 8 - exponent)) > 255.0) ++exponent;
    uvec3 q = uvec3(round(v * ldexp(1.0, 8 - exponent)));
    return q.r | q.g << 8 | q.b << 16 | uint(exponent + 128) << 24;
}

vec3 unpack_rgbe(uint packed) {
    vec3 q = vec3(uvec3(packed, packed >> 8, packed >> 16) & 255u);
    return q * ldexp(1.0, int(packed >> 24) - 136);
}

uvec3 unpack_uint10(uint packed) {
    return uvec3(packed, packed >> 10, packed >> 20) & 1023u;
}

vec3 unpack_unorm10(uint packed) {
    return vec3(unpack_uint10(packed)) / 1023.0;
}

#endif
