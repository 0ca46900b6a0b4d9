// Sums over the list of fragments of a voxel, which do not depend on its order. The including pass
// declares `fragments` and `fragment_emission`.
#ifndef LUMIVOX_SUMS
#define LUMIVOX_SUMS

#include "gi/shared/voxel/records.glsl"

// Sum of 32-bit products, each split into two halves: nothing carries while the sum of all weights
// fits in 32 bits.
struct SmallSum { uvec3 low, high; };

void add_small(inout SmallSum sum, uint weight, uvec3 value) {
    uvec3 product = weight * value;
    sum.low += product & 0xffffu;
    sum.high += product >> 16;
}

vec3 mean(SmallSum sum, uint weight) {
    return (vec3(sum.high) * 65536.0 + vec3(sum.low)) / float(weight);
}

struct Sum { uvec3 low, high; };

void add_product(inout Sum sum, uint weight, uvec3 value) {
    uvec3 high, low, carry;
    umulExtended(uvec3(weight), value, high, low);
    sum.low = uaddCarry(sum.low, low, carry);
    sum.high += high + carry;
}

vec3 mean(Sum sum, uint weight) {
    return (vec3(sum.high) * 4294967296.0 + vec3(sum.low)) / float(weight);
}

uvec3 unpack_emission(uvec2 e) {
    return uvec3(e.x & 0x1fffffu, e.y & 0x1fffffu, e.x >> 21 | (e.y >> 21) << 11);
}

// Emission of the list's fragments that face the front: a surface emits that way.
Sum emission_ahead(uint at, vec3 front) {
    Sum ahead = Sum(uvec3(0u), uvec3(0u));
    while (at != 0u) {
        Fragment fragment = fragments[at - 1u];
        if (dot(unpack_unit(fragment.normal_albedo.x), front) >= 0.0)
            add_product(ahead, area_of(fragment), unpack_emission(fragment_emission[at - 1u]));
        at = fragment.position_next.y;
    }
    return ahead;
}

// Mean emission [stored steps] and the share of it that leaves the front.
vec4 emission_of(Sum all, uint area, uint head, vec3 front) {
    vec3 emitted = mean(all, area), ahead = mean(emission_ahead(head, front), area);
    float total = emitted.r + emitted.g + emitted.b;
    return vec4(emitted, total > 0.0 ? (ahead.r + ahead.g + ahead.b) / total : 0.0);
}

#endif
