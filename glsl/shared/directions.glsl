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

// Two numbers of [0, 1) for a pixel: one of n² patterns that repeat every n×n pixels (interleaved
// sampling, Keller & Heidrich 2001), as the points of a Hammersley set, so that the patterns of a
// tile cover what one pixel leaves out.
vec2 interleaved_offset(ivec2 pixel, uint n) {
    uint count = n * n;
    // Consecutive numbers lie far apart in the tile: a fixed odd stride through it.
    uint index = (uint(pixel.x) % n + n * (uint(pixel.y) % n)) * 7u % count;
    float inverse = float(bitfieldReverse(index)) * 2.3283064365386963e-10;
    // Azimuths differ between tiles, so that what the patterns miss is noise rather than bands.
    uint tile = (uint(pixel.x) / n) * 0x9e3779b1u ^ (uint(pixel.y) / n) * 0x85ebca77u;
    tile = (tile ^ tile >> 15) * 0x2c1b3c6du;
    return vec2((float(index) + 0.5) / float(count),
        fract(inverse + float(tile >> 8) * (1.0 / 16777216.0)));
}

#endif
