// Which pixels light is gathered for: all, one in each square, or all in another order, a texel
// each (Rust: render::Grid).
#ifndef LUMIVOX_GATHERED
#define LUMIVOX_GATHERED

#include "shared/frame.glsl"

// frame.gathered: x, y: size of the picture [texels]; z, 8 bits each: the width of the squares of
// pixels [px] in which one gathers; of the pixels that do, one in so many along each axis; the
// first of these along x; along y; w, 8 bits each: parts that the picture is split into along x;
// along y.

// Which of the pixels that gather, counted along each axis, a texel has.
ivec2 place_of(ivec2 texel) {
    uvec2 at = uvec2(texel), parts = uvec2(frame.gathered.w & 0xffu, frame.gathered.w >> 8);
    uvec2 part = frame.gathered.xy / parts;
    uint step = frame.gathered.z >> 8 & 0xffu;
    uvec2 first = uvec2(frame.gathered.z >> 16 & 0xffu, frame.gathered.z >> 24);
    return ivec2((at % part * parts + at / part) * step + first);
}

// The pixel of the whole picture.
ivec2 pixel_of(ivec2 place) {
    int width = int(frame.gathered.z & 0xffu);
    return place * width + width / 2;
}

bool is_gathered(ivec2 texel) {
    return all(lessThan(texel, ivec2(frame.gathered.xy)));
}

#endif
