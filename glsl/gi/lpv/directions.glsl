// Discrete directions, with what a map of the environment sends along them.
#ifndef LUMIVOX_LPV_DIRECTIONS
#define LUMIVOX_LPV_DIRECTIONS

#include "shared/sky.glsl"

struct Direction {
    vec4 travel;     // xyz: unit vector; w: weight [sr]
    vec4 sky;        // rgb: radiance of a map [in steps of the scale]; black where there is none
};

// What cells have along a direction, where alpha is the share of the environment that arrives.
vec4 with_sky(Direction direction, vec4 stored) {
    if (SKY) stored.rgb += stored.a * direction.sky.rgb;
    return stored;
}

#endif
