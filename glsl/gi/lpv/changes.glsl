// Two sums of radiance, as whole steps of 64 bits: the order of sides, which differs from run to
// run, does not matter.
#ifndef LUMIVOX_LPV_CHANGES
#define LUMIVOX_LPV_CHANGES

const float CHANGE_STEPS = 65536.0;   // of a stored 1

uvec4 change_in_steps(vec2 change) {
    uvec2 steps = uvec2(min(round(change * CHANGE_STEPS), vec2(4294967040.0)));
    return uvec4(steps.x, 0u, steps.y, 0u);
}

// xy, zw: low and high word of a sum.
uvec4 sum_of(uvec4 a, uvec4 b) {
    uvec2 carry, low = uaddCarry(a.xz, b.xz, carry), high = a.yw + b.yw + carry;
    return uvec4(low.x, high.x, low.y, high.y);
}

#endif
