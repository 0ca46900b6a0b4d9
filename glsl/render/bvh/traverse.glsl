// Rays against the triangles of the scene: the nearest hit, or whether there is any. Both sides of
// a triangle count, and masks where they leave a surface. The including pass binds what
// render/bvh/bindings.glsl declares. Rust: render::bvh.
#ifndef LUMIVOX_BVH_TRAVERSE
#define LUMIVOX_BVH_TRAVERSE

#include "render/bvh/textures.glsl"

const uint NO_TRIANGLE = 0xffffffffu;
const uint WIDTH = 4u, NODE_WORDS = 4u + WIDTH + 6u * WIDTH / 4u;
const uint LEAF = 0x80000000u, DONE = 0xffffffffu;
// Rounding of a box's distances, as a share of what they are the sum of.
const float BOX_ROUNDING = 2e-6;

struct RayHit {
    uint triangle;   // NO_TRIANGLE: nothing
    float t;         // [lengths of the direction]
    vec2 at;         // barycentric coordinates of the second and the third vertex
};

// Boxes that are put off, and where the ray enters each.
uint put_off[BVH_STACK];
uint put_off_keys[BVH_STACK];
uint put_off_count;

// The box that was put off last and is entered by `t`, or DONE.
uint take_back(float t) {
    while (put_off_count > 0u) {
        --put_off_count;
        if (uintBitsToFloat(put_off_keys[put_off_count]) <= t) return put_off[put_off_count];
    }
    return DONE;
}

void order(inout uint a, inout uint b) {
    uint low = min(a, b);
    b = max(a, b);
    a = low;
}

// The nearest box of a node that the ray enters before `t`; the others are put off, the farthest
// first.
uint open_node(uint node, vec3 origin, vec3 inverse, float t) {
    uint first = node * NODE_WORDS, packed = bvh_nodes[first + 3u];
    vec3 corner = uintBitsToFloat(
        uvec3(bvh_nodes[first], bvh_nodes[first + 1u], bvh_nodes[first + 2u]));
    vec3 steps = uintBitsToFloat((uvec3(packed, packed >> 8, packed >> 16) & 255u) << 23);
    vec3 step_t = steps * inverse, corner_t = (corner - origin) * inverse;
    vec3 slack = BOX_ROUNDING * (abs(corner_t) + 255.0 * abs(step_t));
    vec3 enter_t = corner_t - slack, leave_t = corner_t + slack;
    uint planes = first + 4u + WIDTH;
    uvec3 low = uvec3(bvh_nodes[planes], bvh_nodes[planes + 1u], bvh_nodes[planes + 2u]);
    uvec3 high = uvec3(bvh_nodes[planes + 3u], bvh_nodes[planes + 4u], bvh_nodes[planes + 5u]);
    bvec3 falls = lessThan(inverse, vec3(0.0));
    uvec3 near = mix(low, high, falls), far = mix(high, low, falls);
    uint keys[WIDTH];
    for (uint i = 0u; i < WIDTH; ++i) {
        vec3 enters = vec3(near >> 8u * i & 255u) * step_t + enter_t;
        vec3 leaves = vec3(far >> 8u * i & 255u) * step_t + leave_t;
        float from = max(max(enters.x, enters.y), max(enters.z, 0.0));
        float to = min(min(leaves.x, leaves.y), min(leaves.z, t));
        bool is_met = from <= to && (packed >> 24u + i & 1u) != 0u;
        keys[i] = is_met ? floatBitsToUint(from) & ~(WIDTH - 1u) | i : DONE;
    }
    order(keys[0], keys[1]);
    order(keys[2], keys[3]);
    order(keys[0], keys[2]);
    order(keys[1], keys[3]);
    order(keys[1], keys[2]);
    if (keys[0] == DONE) return take_back(t);
    for (uint i = WIDTH - 1u; i > 0u; --i) {
        if (keys[i] == DONE) continue;
        put_off[put_off_count] = bvh_nodes[first + 4u + (keys[i] & WIDTH - 1u)];
        put_off_keys[put_off_count] = keys[i];
        ++put_off_count;
    }
    return bvh_nodes[first + 4u + (keys[0] & WIDTH - 1u)];
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
// reference has it (Rust: scene::rays).
bool meets_triangle(uint triangle, vec3 origin, vec3 direction, out float t, out vec2 at) {
    uvec3 v = vertices_of(triangle);
    vec3 a = position_of(v.x);
    precise vec3 edge_1 = position_of(v.y) - a, edge_2 = position_of(v.z) - a, s = origin - a;
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

// A ray from `origin` up to `t_max` that leaves the triangle `leaves`, and so cannot hit it, nor
// `target`. With `any`, some hit; otherwise the nearest.
RayHit traverse(
    vec3 origin, vec3 direction, float t_max, uint leaves, uint target, bool any) {
    RayHit hit = RayHit(NO_TRIANGLE, t_max, vec2(0.0));
    vec3 inverse = 1.0 / mix(direction, vec3(1e-20), lessThan(abs(direction), vec3(1e-20)));
    for (uint i = 0u; i < BVH_ROOTS; ++i) {
        put_off_count = 0u;
        uint current = bvh_roots[i];
        while (current != DONE) {
            while (current < LEAF) current = open_node(current, origin, inverse, hit.t);
            if (current == DONE) break;
            uint slot = current & 0x07ffffffu, end = slot + (current >> 27 & 15u) + 1u;
            for (; slot < end; ++slot) {
                uint word = bvh_triangles[slot], triangle = word & 0x7fffffffu;
                float t;
                vec2 at;
                if (!meets_triangle(triangle, origin, direction, t, at)) continue;
                if (!is_nearer(t, triangle, hit)) continue;
                if (triangle == leaves || triangle == target) continue;
                if (BVH_MASKS != 0u) {
                    if (word >= 0x80000000u && !is_solid(triangle, at)) continue;
                }
                hit = RayHit(triangle, t, at);
            }
            if (any && hit.triangle != NO_TRIANGLE) return hit;
            current = take_back(hit.t);
        }
    }
    return hit;
}

RayHit closest_hit(vec3 origin, vec3 direction, uint leaves) {
    return traverse(origin, direction, uintBitsToFloat(0x7f800000u), leaves, NO_TRIANGLE, false);
}

// Whether something but the triangles `leaves` and `target` is nearer than `distance`.
bool is_occluded(vec3 origin, vec3 direction, float distance, uint leaves, uint target) {
    return traverse(origin, direction, distance, leaves, target, true).triangle != NO_TRIANGLE;
}

#endif
