// Whether rays touch the box that models have moved in. The including pass declares `params` with
// `low` and `high`.
#ifndef LUMIVOX_PROBES_TOUCHES
#define LUMIVOX_PROBES_TOUCHES

// Before `distance`.
bool touches_box(vec3 origin, vec3 direction, float distance) {
    vec3 along = mix(direction, vec3(1e-20), lessThan(abs(direction), vec3(1e-20)));
    vec3 a = (params.low.xyz - origin) / along, b = (params.high.xyz - origin) / along;
    vec3 enters = min(a, b), leaves = max(a, b);
    float first = max(max(enters.x, enters.y), max(enters.z, 0.0));
    return first <= min(min(leaves.x, leaves.y), min(leaves.z, distance));
}

#endif
