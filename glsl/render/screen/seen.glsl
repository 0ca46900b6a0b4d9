// What a pixel shows without anything in front: the diffuse term, and the environment.
#ifndef LUMIVOX_SEEN
#define LUMIVOX_SEEN

#include "shared/environment.glsl"

// Of the light on the mean of the normals in a pixel, what falls on themselves, from the length of
// their mean (Rust: render::share_of_spread).
float share_of_spread(float length) {
    return 1.0 - 0.75 * (1.0 - length);
}

// ρ/π · E_i, from a texel of the albedo.
vec3 reflected_diffuse(vec4 base, vec3 irradiance) {
    return share_of_spread(base.a) * base.rgb / PI * irradiance;
}

// The environment, as wide as the pixel.
vec3 environment_of_pixel(ivec2 pixel) {
    vec3 ray = pixel_ray(pixel);
    float square = dot(ray, ray), area = 4.0 * length(frame.ray_right.xyz)
        * length(frame.ray_up.xyz) / float(frame.size_px.x * frame.size_px.y);
    return environment_around(normalize(ray), area * pow(square, -1.5));
}

#endif
