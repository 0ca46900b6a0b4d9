// What passes are told that blend the rays of probes, and the steps in which they store light.
#ifndef LUMIVOX_PROBES_BLEND_PARAMS
#define LUMIVOX_PROBES_BLEND_PARAMS

layout(push_constant) uniform BlendParams {
    uint columns;
    uint ray_count;      // of a probe
    uint first_probe;    // of the list
    uint probe_count;    // of those from there on
    float cell_m;        // the smallest spacing
    float kept;          // share of what maps have had, 0 to 1
} params;

// Of what half floats hold: the largest number that a probe stores.
const float MOST_STORED = 1024.0;

// The step for a probe whose largest number is `most`: a power of two, so that twice the light is
// the same numbers with twice the step.
float scale_for(float most) {
    int exponent;
    frexp(max(most, 1e-30) / MOST_STORED, exponent);
    return ldexp(1.0, exponent);
}

#endif
