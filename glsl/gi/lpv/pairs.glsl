// Radiance along a pair of directions: a texel has two times four half floats.
#ifndef LUMIVOX_LPV_PAIRS
#define LUMIVOX_LPV_PAIRS

struct Pair { vec4 radiance[2]; };

uvec4 pack(Pair pair) {
    return uvec4(packHalf2x16(pair.radiance[0].xy), packHalf2x16(pair.radiance[0].zw),
        packHalf2x16(pair.radiance[1].xy), packHalf2x16(pair.radiance[1].zw));
}

Pair unpack(uvec4 words) {
    return Pair(vec4[2](vec4(unpackHalf2x16(words.x), unpackHalf2x16(words.y)),
        vec4(unpackHalf2x16(words.z), unpackHalf2x16(words.w))));
}

#endif
