// The light injected into a voxel, or into a side of it: four sums of 40 bits.
#ifndef LUMIVOX_FLUX
#define LUMIVOX_FLUX

// word  0 … 3                                 4
//       | low words of r, g, b, lit area |    | their high bytes |
const uint FLUX_WORDS = 5u;
const float LARGEST_FLUX = 1099500000000.0;   // just below 2⁴⁰

#endif
