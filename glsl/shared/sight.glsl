// Lines of sight that are no longer a pixel's own, and what is seen along them (Rust:
// render::clear).
#ifndef LUMIVOX_SIGHT
#define LUMIVOX_SIGHT

struct SightRay {
    vec4 origin;      // xyz: where it starts [m]; w: where it ends along its direction [m]
    vec4 direction;   // xyz: of unit length, or 0: nothing is asked
};

struct Sight {
    vec4 light;       // rgb: radiance of what it meets [W/(m² sr)]; a: share that meets nothing
};

#endif
