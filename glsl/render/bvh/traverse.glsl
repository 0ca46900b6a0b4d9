// Rays against the triangles of the scene: the nearest hit, or whether there is any. Both sides of
// a triangle count, and masks where they leave a surface. The including pass binds what
// render/bvh/bindings.glsl declares. Rust: render::bvh.
#ifndef LUMIVOX_BVH_TRAVERSE
#define LUMIVOX_BVH_TRAVERSE

#include "render/bvh/textures.glsl"

const uint NO_TRIANGLE = 0xffffffffu;
const uint WIDTH = 4u;   // boxes of a node
// What a ray opens next: a node; LEAF and above, triangles; nothing that is in hand; nothing more.
const uint LEAF = 0x80000000u, NONE = 0xfffffffeu, DONE = 0xffffffffu;
// Nodes and triangles of a row of their image.
const uint ROW_BITS = 10u, ROW_MASK = (1u << ROW_BITS) - 1u;
// Bits of a record below its node.
const uint ORDER_BITS = 2u * WIDTH + 1u, ORDER_MASK = (1u << ORDER_BITS) - 1u;
// Rounding of a box's distances, as a share of what they are the sum of.
const float BOX_ROUNDING = 2e-6;

struct RayHit {
    uint triangle;   // NO_TRIANGLE: nothing
    float t;         // [lengths of the direction]
    vec2 at;         // barycentric coordinates of the second and the third vertex
};

// Records of nodes of which boxes are put off: the node, and under a leading 1 the places of these
// boxes in it, two bits each, the nearest lowest.
uint put_off[BVH_STACK];

bool is_empty(uint record) {
    return (record & ORDER_MASK) <= 1u;
}

// Words as texels: loads of a texel come in one piece, those of a buffer's words one by one.
uvec4 node_words(uint node, uint part) {
    uvec2 place = uvec2((node & ROW_MASK) * 4u + part, node >> ROW_BITS);
    return texelFetch(usampler2D(bvh_nodes, nearest_clamp), ivec2(place), 0);
}

uvec4 triangle_words(uint slot, uint part) {
    uvec2 place = uvec2((slot & ROW_MASK) * 3u + part, slot >> ROW_BITS);
    return texelFetch(usampler2D(bvh_triangles, nearest_clamp), ivec2(place), 0);
}

void order(inout uint a, inout uint b) {
    uint low = min(a, b);
    b = max(a, b);
    a = low;
}

// The record of the boxes of a node that the ray enters before `t`.
uint open_node(uint node, vec3 origin, vec3 inverse, float t) {
    uvec4 head = node_words(node, 0u), planes = node_words(node, 1u);
    uvec2 rest = node_words(node, 2u).xy;
    vec3 corner = uintBitsToFloat(head.xyz);
    vec3 steps = uintBitsToFloat((uvec3(head.w, head.w >> 8, head.w >> 16) & 255u) << 23);
    vec3 step_t = steps * inverse, corner_t = (corner - origin) * inverse;
    vec3 slack = BOX_ROUNDING * (abs(corner_t) + 255.0 * abs(step_t));
    vec3 enter_t = corner_t - slack, leave_t = corner_t + slack;
    uvec3 low = planes.xyz, high = uvec3(planes.w, rest);
    bvec3 falls = lessThan(inverse, vec3(0.0));
    uvec3 near = mix(low, high, falls), far = mix(high, low, falls);
    uint keys[WIDTH];
    for (uint i = 0u; i < WIDTH; ++i) {
        vec3 enters = vec3(near >> 8u * i & 255u) * step_t + enter_t;
        vec3 leaves = vec3(far >> 8u * i & 255u) * step_t + leave_t;
        float from = max(max(enters.x, enters.y), max(enters.z, 0.0));
        float to = min(min(leaves.x, leaves.y), min(leaves.z, t));
        bool is_met = from <= to && (head.w >> 24u + i & 1u) != 0u;
        keys[i] = is_met ? floatBitsToUint(from) & ~(WIDTH - 1u) | i : DONE;
    }
    order(keys[0], keys[1]);
    order(keys[2], keys[3]);
    order(keys[0], keys[2]);
    order(keys[1], keys[3]);
    order(keys[1], keys[2]);
    uint places = 1u;
    for (int i = int(WIDTH) - 1; i >= 0; --i)
        places = keys[i] == DONE ? places : places << 2 | keys[i] & WIDTH - 1u;
    return node << ORDER_BITS | places;
}

// What the nearest box of a record holds. The record has one box less then.
uint take_nearest(inout uint record) {
    uvec4 children = node_words(record >> ORDER_BITS, 3u);
    uvec2 two = (record & 2u) != 0u ? children.zw : children.xy;
    uint child = (record & 1u) != 0u ? two.y : two.x;
    record = record & ~ORDER_MASK | (record & ORDER_MASK) >> 2;
    return child;
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

// A ray from `origin` up to `t_max` that leaves the triangle `leaves`, and so cannot hit it, nor
// `target`. With `any`, some hit; otherwise the nearest. Lanes of a vector wait for each other, so
// each turn of the one loop opens a node and meets a triangle, whichever of them a lane has.
RayHit traverse(
    vec3 origin, vec3 direction, float t_max, uint leaves, uint target, bool any) {
    RayHit hit = RayHit(NO_TRIANGLE, t_max, vec2(0.0));
    vec3 inverse = 1.0 / mix(direction, vec3(1e-20), lessThan(abs(direction), vec3(1e-20)));
    for (uint i = 0u; i < BVH_ROOTS; ++i) {
        uint next = bvh_roots[i], record = 0u, put_off_count = 0u, slot = 0u, end = 0u;
        while (next != DONE || slot < end) {
            uint opened = 0u;
            if (next < LEAF) opened = open_node(next, origin, inverse, hit.t);
            // In any case: a store of some lanes alone is a branch for each of them.
            put_off[put_off_count] = record;
            if (!is_empty(opened)) {
                put_off_count += is_empty(record) ? 0u : 1u;
                record = opened;
            }
            if (next < LEAF || next == NONE) {
                if (is_empty(record) && put_off_count > 0u) record = put_off[--put_off_count];
                next = DONE;
                if (!is_empty(record)) next = take_nearest(record);
            }
            if (next >= LEAF && next < NONE && slot == end) {
                slot = next & 0x07ffffffu;
                end = slot + (next >> 27 & 15u) + 1u;
                next = NONE;
            }
            if (slot < end) {
                uint word;
                float t;
                vec2 at;
                bool is_met = meets_triangle(slot, origin, direction, word, t, at);
                uint triangle = word & 0x7fffffffu;
                is_met = is_met && is_nearer(t, triangle, hit) && triangle != leaves
                    && triangle != target;
                if (BVH_MASKS != 0u) {
                    if (is_met && word >= 0x80000000u) is_met = is_solid(triangle, at);
                }
                if (is_met) hit = RayHit(triangle, t, at);
                ++slot;
                if (any && is_met) {
                    next = DONE;
                    slot = end;
                }
            }
        }
        if (any && hit.triangle != NO_TRIANGLE) break;
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
