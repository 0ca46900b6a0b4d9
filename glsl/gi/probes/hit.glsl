// First word of what a ray of a probe keeps of its hit, where it has one: the triangle and flags.
#ifndef LUMIVOX_PROBES_HIT
#define LUMIVOX_PROBES_HIT

const uint HIT_TRIANGLE = 0x3fffffffu;
const uint HIT_IS_FLAT = 0x40000000u;    // the shading normal is the geometric one
const uint HIT_IS_WHOLE = 0x80000000u;   // emits, or has a lobe: taken from the triangle each time

#endif
