// Which directions probes look along (Rust: gi::probes::rays). The including pass declares
// `ray_set`.
#ifndef LUMIVOX_PROBES_RAYS
#define LUMIVOX_PROBES_RAYS

#include "shared/random.glsl"
#include "gi/probes/ray_texel.glsl"

// The turn of a probe's rays, uniform over all turns (Shoemake 1992): what the set misses is noise,
// and no pattern that all probes have.
mat3 turn_of(uint seed) {
    vec3 u = unit_numbers(pcg3(uvec3(seed, 0x9e3779b9u, 0x85ebca6bu)));
    float a = sqrt(1.0 - u.x), b = sqrt(u.x), p = 6.283185307179586 * u.y;
    float q = 6.283185307179586 * u.z;
    vec4 t = vec4(a * sin(p), a * cos(p), b * sin(q), b * cos(q));
    vec3 x2 = t.xyz * t.x * 2.0, y2 = t.xyz * t.y * 2.0, w2 = t.xyz * t.w * 2.0;
    float zz = 2.0 * t.z * t.z;
    return mat3(1.0 - y2.y - zz, x2.y + w2.z, x2.z - w2.y,
        x2.y - w2.z, 1.0 - x2.x - zz, y2.z + w2.x,
        x2.z + w2.y, y2.z - w2.x, 1.0 - x2.x - y2.y);
}

// Direction of ray `ray` of a probe, before it is turned.
vec3 ray_of_set(uint ray) {
    return texelFetch(sampler2D(ray_set, nearest_clamp), texel_of_ray(ray), 0).xyz;
}

#endif
