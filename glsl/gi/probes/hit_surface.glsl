// The surface that a ray of a probe has met, as it is kept for all frames, in one texel. The
// including pass binds what gi/shared/paths/vertex.glsl needs.
#ifndef LUMIVOX_PROBES_HIT_SURFACE
#define LUMIVOX_PROBES_HIT_SURFACE

#include "gi/probes/hit.glsl"
#include "gi/shared/paths/vertex.glsl"
#include "shared/packing.glsl"

// Normals that are as near are one.
const float SAME_NORMAL = 1.0 - 1e-6;
// Rays start this far off, in units of the largest coordinate of both ends: what a distance along
// a direction is rounded by.
const float OFFSET_OF_HIT = 32.0 * 1.1920929e-7;

// x: the triangle and flags; y: shading normal, octahedral; z: square roots of the albedo, 11, 11
// and 10 bits; w: distance [m].
uvec4 pack_hit(uint triangle, float distance, PathVertex v) {
    bool is_whole = v.roughness >= 0.0 || v.emission != vec3(0.0);
    bool is_flat = dot(v.normal, v.geometric_normal) >= SAME_NORMAL;
    uvec3 root = uvec3(round(sqrt(clamp(v.albedo, 0.0, 1.0)) * vec3(2047.0, 2047.0, 1023.0)));
    return uvec4(triangle | (is_flat ? HIT_IS_FLAT : 0u) | (is_whole ? HIT_IS_WHOLE : 0u),
        pack_unit(v.normal), root.r | root.g << 11 | root.b << 22, floatBitsToUint(distance));
}

// Barycentric coordinates of a place of a triangle.
vec2 place_on_triangle(vec3 a, vec3 b, vec3 c, vec3 place) {
    vec3 e1 = b - a, e2 = c - a, n = cross(e1, e2), from = place - a;
    return vec2(dot(cross(from, e2), n), dot(cross(e1, from), n)) / max(dot(n, n), 1e-30);
}

// The surface that a ray `from` a probe has met, which is something.
PathVertex unpack_hit(uvec4 hit, vec3 from, vec3 direction) {
    uint triangle = hit.x & HIT_TRIANGLE;
    vec3 position = from + uintBitsToFloat(hit.w) * direction;
    vec3 normal = unpack_unit(hit.y), geometric = normal;
    bool is_flat = (hit.x & HIT_IS_FLAT) != 0u, is_whole = (hit.x & HIT_IS_WHOLE) != 0u;
    if (is_whole || !is_flat) {
        uvec3 v = vertices_of(triangle);
        vec3 a = position_of(v.x), b = position_of(v.y), c = position_of(v.z);
        if (is_whole)
            return vertex_at(triangle, place_on_triangle(a, b, c, position), -direction);
        geometric = normalize(cross(b - a, c - a));
        if (dot(geometric, direction) > 0.0) geometric = -geometric;
    }
    uvec3 root = uvec3(hit.z, hit.z >> 11, hit.z >> 22) & uvec3(2047u, 2047u, 1023u);
    vec3 share = vec3(root) / vec3(2047.0, 2047.0, 1023.0);
    vec3 largest = max(abs(position), abs(from));
    PathVertex v;
    v.origin = position
        + geometric * (OFFSET_OF_HIT * max(largest.x, max(largest.y, largest.z)));
    v.geometric_normal = geometric;
    v.normal = normal;
    v.to_viewer = -direction;
    v.albedo = share * share;
    v.f0 = vec3(0.0);
    v.roughness = -1.0;
    v.emission = vec3(0.0);
    v.position = position;
    v.triangle = triangle;
    return v;
}

#endif
