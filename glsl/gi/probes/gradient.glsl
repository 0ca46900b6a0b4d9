// How the luminance of a probe's irradiance changes with its place, by how what its rays meet moves
// across its view (Ward & Heckbert 1992; docs/gi/probes.md). The including pass declares
// `params.cell_m`, the smallest spacing [m].
#ifndef LUMIVOX_PROBES_GRADIENT
#define LUMIVOX_PROBES_GRADIENT

#include "gi/probes/hit.glsl"
#include "shared/luminance.glsl"

// Nearer surfaces (cells) count as so near, and flatter views (cosines) as so flat.
const float NEAREST = 0.25, FLATTEST = 0.1;

// What a ray brings to gradients, 0 where it meets nothing: xyz: its surface's normal over the
// cosine that it is seen with; w: luminance over distance [W/(m² sr) per cell].
vec4 gradient_source(uvec4 hit, vec3 direction, vec3 light) {
    if (hit.x == 0xffffffffu) return vec4(0.0);
    uvec3 v = vertices_of(hit.x & HIT_TRIANGLE);
    vec3 a = position_of(v.x), b = position_of(v.y), c = position_of(v.z);
    vec3 normal = normalize(cross(b - a, c - a));
    float cosine = -dot(normal, direction);
    float distance = max(uintBitsToFloat(hit.w) / params.cell_m, NEAREST);
    return vec4(normal * sign(cosine) / max(abs(cosine), FLATTEST), luminance_of(light) / distance);
}

// Its part of the gradient of irradiance on a plane of normal `normal`.
vec3 gradient_of(vec4 source, vec3 direction, vec3 normal, float cosine) {
    if (cosine <= 0.0) return vec3(0.0);
    return source.w * (cosine * (source.xyz + 4.0 * direction) - normal);
}

#endif
