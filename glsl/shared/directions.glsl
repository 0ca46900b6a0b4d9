// Hemisphere directions and interleaved sampling patterns.
#ifndef LUMIVOX_DIRECTIONS
#define LUMIVOX_DIRECTIONS

// Tangent and bitangent of a unit vector (Duff et al. 2017).
mat3 frame_around(vec3 n) {
    float s = n.z >= 0.0 ? 1.0 : -1.0;
    float a = -1.0 / (s + n.z), b = n.x * n.y * a;
    return mat3(
        vec3(1.0 + s * n.x * n.x * a, s * b, -s * n.x), vec3(b, s + n.y * n.y * a, -n.y), n);
}

// Direction with sin²θ = u at azimuth φ around n: uniform (u, φ) are cosine-distributed directions
// (Malley).
vec3 hemisphere_direction(mat3 around, float u, float phi) {
    float r = sqrt(clamp(u, 0.0, 1.0));
    return around * vec3(r * cos(phi), r * sin(phi), sqrt(max(1.0 - u, 0.0)));
}

// Two numbers of [0, 1) for a pixel: one of w·h patterns that repeat every w×h pixels (interleaved
// sampling, Keller & Heidrich 2001), as the points of a Hammersley set, so that the patterns of a
// tile cover what one pixel leaves out. `pattern` has w, h and the stride, 8 bits each, and whether
// tiles are turned; `walk` is
// the frame's number: each pixel walks through all patterns, and each time around their points
// move by the two numbers of the R2 sequence (Roberts 2018). Rust: gi::shared::interleave::Pattern.
vec2 interleaved_offset(ivec2 pixel, uint pattern, uint walk) {
    uvec2 size = uvec2(pattern & 0xffu, pattern >> 8 & 0xffu), at = uvec2(pixel) % size;
    uint count = size.x * size.y;
    float moved = float((0x80000000u + 0xc13fa9a9u * walk) >> 8) * (1.0 / 16777216.0);
    uint turn = 0x91e10da6u * walk;
    uint index = (at.x + size.x * at.y + walk % count) * (pattern >> 16 & 0xffu) % count;
    if (count > 1u && pattern >> 24 != 0u) {
        // Azimuths differ between tiles, so that what the patterns miss is noise rather than bands.
        uvec2 tile = uvec2(pixel) / size;
        uint mixed = tile.x * 0x9e3779b1u ^ tile.y * 0x85ebca77u;
        turn += (mixed ^ mixed >> 15) * 0x2c1b3c6du;
    }
    float inverse = float(bitfieldReverse(index)) * 2.3283064365386963e-10;
    return vec2((float(index) + moved) / float(count),
        fract(inverse + float(turn >> 8) * (1.0 / 16777216.0)));
}

#endif
