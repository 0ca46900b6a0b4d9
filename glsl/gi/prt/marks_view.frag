#version 460
#extension GL_GOOGLE_include_directive : require
// prt.marks_view: which point each pixel shows most, or the cluster of that point, each in its own
// colour.
#include "gi/prt/drawn.glsl"

layout(location = 0) out vec4 seen;

layout(constant_id = 0) const uint CLUSTERS = 0;   // of points

// four points a word
layout(std430, set = 1, binding = 2) restrict readonly buffer Clusters { uint point_clusters[]; };

// Bright, and unlike that of the next number.
vec3 color_of(uint number) {
    uint hash = (number + 1u) * 0x9e3779b9u;
    hash = (hash ^ hash >> 15) * 0x85ebca6bu;
    hash ^= hash >> 13;
    return 0.25 + 0.75 * vec3(hash & 0xffu, hash >> 8 & 0xffu, hash >> 16 & 0xffu) / 255.0;
}

void main() {
    bool is_gone = is_cut();
    uvec3 points;
    vec3 shares;
    seen = vec4(0.0);
    if (find_points(points, shares)) {
        float most = max(shares.x, max(shares.y, shares.z));
        uint number = shares.x == most ? points.x : shares.y == most ? points.y : points.z;
        if (CLUSTERS != 0u)
            number = bitfieldExtract(point_clusters[number / 4u], int(number % 4u) * 8, 8);
        seen = vec4(color_of(number), 1.0);
    }
    if (is_gone) discard;
}
