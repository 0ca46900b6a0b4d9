// Rays through the hierarchies of the scene node by node, on devices without ray queries.
#ifndef LUMIVOX_BVH_NODES
#define LUMIVOX_BVH_NODES

#include "render/bvh/triangle.glsl"

const uint WIDTH = 4u;   // boxes of a node
// What a ray opens next: a node; LEAF and above, triangles; nothing that is in hand; nothing more.
const uint LEAF = 0x80000000u, NONE = 0xfffffffeu, DONE = 0xffffffffu;
// Bits of a record below its node.
const uint ORDER_BITS = 2u * WIDTH + 1u, ORDER_MASK = (1u << ORDER_BITS) - 1u;
// Rounding of a box's distances, as a share of what they are the sum of.
const float BOX_ROUNDING = 2e-6;

// Records of nodes of which boxes are put off: the node, and under a leading 1 the places of these
// boxes in it, two bits each, the nearest lowest.
uint put_off[BVH_STACK];

bool is_empty(uint record) {
    return (record & ORDER_MASK) <= 1u;
}

uvec4 node_words(uint node, uint part) {
    uvec2 place = uvec2((node & ROW_MASK) * 4u + part, node >> ROW_BITS);
    return texelFetch(usampler2D(bvh_tree, nearest_clamp), ivec2(place), 0);
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
                bool is_met = meet(slot, origin, direction, leaves, target, hit);
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

#endif
