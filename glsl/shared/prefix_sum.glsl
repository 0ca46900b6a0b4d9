// Exclusive prefix sum over a workgroup (Hillis & Steele 1986), whose size must be declared before.
#ifndef LUMIVOX_PREFIX_SUM
#define LUMIVOX_PREFIX_SUM

shared uint prefix_sums[gl_WorkGroupSize.x];

// Sum of `value` over all threads before this one; `total` is the sum over all threads.
uint workgroup_prefix_sum(uint value, out uint total) {
    uint thread = gl_LocalInvocationIndex;
    prefix_sums[thread] = value;
    for (uint step = 1u; step < gl_WorkGroupSize.x; step <<= 1) {
        barrier();
        uint before = thread >= step ? prefix_sums[thread - step] : 0u;
        barrier();
        prefix_sums[thread] += before;
    }
    barrier();
    total = prefix_sums[gl_WorkGroupSize.x - 1u];
    uint result = prefix_sums[thread] - value;
    barrier();
    return result;
}

#endif
