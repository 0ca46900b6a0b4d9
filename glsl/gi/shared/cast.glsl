// Rays that one technique casts through what another keeps, and what they bring (Rust:
// gi::CastRays).
#ifndef LUMIVOX_CAST
#define LUMIVOX_CAST

struct CastRay {
    vec4 origin;      // xyz: where it starts [m]; w: bits of a number that its family has alone
    vec4 direction;   // xyz: of unit length, or 0: not cast; w: bits of its number in the family
};

struct CastHit {
    vec4 light;   // rgb: radiance [W/(m² sr)]; w: how far that is [m], infinite: nothing is met
};

#endif
