// Eight texels of radiance premultiplied by opacity to one of twice their size.
//
// Box: their mean. Directional: along each axis the two texels of each of the four pairs are
// composited front to back, seen from either side, and the twelve results are averaged (the
// six-direction pre-integration of Crassin et al. 2011, section 5.2, kept in one texel); a wall one
// voxel thick stays opaque along its normal, which the box lets fade by half at every level.
#ifndef LUMIVOX_PREFILTER
#define LUMIVOX_PREFILTER

// Mean over both directions of a composited over b: colour a + (1 − α_a) b, opacity α_a + α_b − α_a
// α_b.
vec4 composite_pair(vec4 a, vec4 b) {
    return a + b - 0.5 * (a.a * b + b.a * a);
}

// `mode`: 0 box, 1 directional, 2 directional with the opacity of the most opaque axis. x is the
// lowest bit of a texel's number.
vec4 filter_eight(vec4 c[8], uint mode) {
    vec4 sum = vec4(0.0);
    for (int i = 0; i < 8; ++i) sum += c[i];
    vec4 result = sum * 0.125;
    if (mode != 0u && sum.a > 0.0) {
        vec4 x = composite_pair(c[0], c[1]) + composite_pair(c[2], c[3])
            + composite_pair(c[4], c[5]) + composite_pair(c[6], c[7]);
        vec4 y = composite_pair(c[0], c[2]) + composite_pair(c[1], c[3])
            + composite_pair(c[4], c[6]) + composite_pair(c[5], c[7]);
        vec4 z = composite_pair(c[0], c[4]) + composite_pair(c[1], c[5])
            + composite_pair(c[2], c[6]) + composite_pair(c[3], c[7]);
        result = (x + y + z) / 12.0;
        if (mode == 2u) result *= max(x.a, max(y.a, z.a)) * 0.25 / result.a;
    }
    return result;
}

// Place of texel `i` of the eight for filter_face. `face`: of +x, −x, +y, −y, +z, −z, from where a
// ray in the opposite direction comes.
ivec3 face_child(int i, int face) {
    ivec3 at = ivec3((i & 1) ^ (~face & 1), i >> 1 & 1, i >> 2);
    return face < 2 ? at : face < 4 ? at.zxy : at.yzx;
}

// Eight texels of one face to one of twice their size: along the face's axis the nearer texel of
// each pair, the even one, over the farther one, and the mean of the four (Crassin et al. 2011,
// section 5.2).
vec4 filter_face(vec4 c[8]) {
    vec4 sum = vec4(0.0);
    for (int i = 0; i < 8; i += 2) sum += c[i] + (1.0 - c[i].a) * c[i + 1];
    return 0.25 * sum;
}

#endif
