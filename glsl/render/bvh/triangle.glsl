// Triangles as rays meet them, whoever finds those near a ray. Both sides count, and masks where
// they leave a surface. The including pass binds what render/bvh/bindings.glsl declares. Rust:
// render::bvh.
#ifndef LUMIVOX_BVH_TRIANGLE
#define LUMIVOX_BVH_TRIANGLE

#include "render/bvh/textures.glsl"

const uint NO_TRIANGLE = 0xffffffffu;
// Nodes and triangles of a row of their image.
const uint ROW_BITS = 10u, ROW_MASK = (1u << ROW_BITS) - 1u;

struct RayHit {
    uint triangle;   // NO_TRIANGLE: nothing
    float t;         // [lengths of the direction]
    vec2 at;         // barycentric coordinates of the second and the third vertex
};

// Words as texels: loads of a texel come in one piece, those of a buffer's words one by one.
uvec4 triangle_words(uint slot, uint part) {
    uvec2 place = uvec2((slot & ROW_MASK) * 3u + part, slot >> ROW_BITS);
    return texelFetch(usampler2D(bvh_triangles, nearest_clamp), ivec2(place), 0);
}

vec3 exact_cross(vec3 a, vec3 b) {
    precise vec3 result = a.yzx * b.zxy - a.zxy * b.yzx;
    return result;
}

float exact_dot(vec3 a, vec3 b) {
    precise vec3 products = a * b;
    precise float result = products.x + products.y + products.z;
    return result;
}

// Distance and place where a ray meets a triangle (Möller & Trumbore 1997), each operation as the
// reference has it (Rust: scene::rays). `word` is the triangle's number and whether it has a mask.
bool meets_triangle(
    uint slot, vec3 origin, vec3 direction, out uint word, out float t, out vec2 at) {
    uvec4 first = triangle_words(slot, 0u);
    vec3 edge_1 = uintBitsToFloat(triangle_words(slot, 1u).xyz);
    vec3 edge_2 = uintBitsToFloat(triangle_words(slot, 2u).xyz);
    precise vec3 s = origin - uintBitsToFloat(first.xyz);
    word = first.w;
    vec3 p = exact_cross(direction, edge_2);
    float determinant = exact_dot(edge_1, p);
    precise float inverse = 1.0 / determinant;
    vec3 q = exact_cross(s, edge_1);
    precise float u = exact_dot(s, p) * inverse, w = exact_dot(direction, q) * inverse,
                  along = exact_dot(edge_2, q) * inverse, sum = u + w;
    t = along;
    at = vec2(u, w);
    return determinant != 0.0 && u >= 0.0 && w >= 0.0 && sum <= 1.0 && along > 0.0;
}

// Of two triangles as near, the first counts, in whatever order a hierarchy has them.
bool is_nearer(float t, uint triangle, RayHit hit) {
    if (t == hit.t) return hit.triangle != NO_TRIANGLE && triangle < hit.triangle;
    return t < hit.t;
}

// Meets a triangle; where it is nearer than the hit, it is the hit then.
bool meet(
    uint slot, vec3 origin, vec3 direction, uint leaves, uint target, inout RayHit hit) {
    uint word;
    float t;
    vec2 at;
    bool is_met = meets_triangle(slot, origin, direction, word, t, at);
    uint triangle = word & 0x7fffffffu;
    is_met = is_met && is_nearer(t, triangle, hit) && triangle != leaves && triangle != target;
    if (BVH_MASKS != 0u) {
        if (is_met && word >= 0x80000000u) is_met = is_solid(triangle, at);
    }
    if (is_met) hit = RayHit(triangle, t, at);
    return is_met;
}

#endif
