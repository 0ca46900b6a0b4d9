// The environment: one radiance, or a map (Rust: render::GpuEnvironment).
#ifndef LUMIVOX_ENVIRONMENT
#define LUMIVOX_ENVIRONMENT

#include "shared/frame.glsl"
#include "shared/packing.glsl"
#include "shared/sky.glsl"

layout(set = 0, binding = 11) uniform texture2D sky;

// Bilinear, at a place of [-1, 1]² in the level with so many texels along an edge. Those on the
// edge have their middles there.
vec3 sky_in_level(vec2 place, float level) {
    float edge = exp2(log2(frame.sky.z) - level);
    vec2 uv = (place * 0.5 + 0.5) * (1.0 - 1.0 / edge) + 0.5 / edge;
    return textureLod(sampler2D(sky, linear_clamp), uv, level).rgb;
}

// Mean radiance [W/(m² sr)] of a map of about a solid angle [sr] around a unit direction.
vec3 sky_around(vec3 direction, float solid_angle) {
    vec2 turn = frame.sky.xy;
    vec3 turned = vec3(turn.x * direction.x - turn.y * direction.z, direction.y,
        turn.y * direction.x + turn.x * direction.z);
    float sum = abs(turned.x) + abs(turned.y) + abs(turned.z);
    // A texel of n along an edge has a solid angle of 4 |d|₁³ / (n - 1)²; the filter between texels
    // is as wide as a disc of π texels.
    float edge = 1.0
        + 2.0 * sqrt(PI * sum * sum * sum / clamp(solid_angle, 1e-9, 4.0 * PI));
    float level = clamp(log2(frame.sky.z / edge), 0.0, log2(frame.sky.z / frame.sky.w));
    vec2 place = octahedral_from_unit(turned.xzy);
    vec3 finer = sky_in_level(place, floor(level)), coarser = sky_in_level(place, ceil(level));
    return frame.environment.rgb * mix(finer, coarser, fract(level));
}

// Mean radiance [W/(m² sr)] of about a solid angle [sr] around a unit direction.
vec3 environment_around(vec3 direction, float solid_angle) {
    if (SKY) return sky_around(direction, solid_angle);
    return frame.environment.rgb;
}

// The environment along one of `count` rays over all directions.
vec3 environment_of_ray(vec3 direction, uint count) {
    return environment_around(direction, 4.0 * PI / float(count));
}

// The same along one of `count` that a surface scatters with a density [1/sr]. No ray is wider than
// one of as many over half a sphere: at a grazing angle it would see what is below the surface.
vec3 environment_of_scattered(vec3 direction, float density, uint count) {
    return environment_around(direction, 1.0 / (max(density, 0.5 / PI) * float(count)));
}

#endif
