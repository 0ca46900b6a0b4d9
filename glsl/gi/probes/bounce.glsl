// What each ray brings of the light that probes have. The including pass declares the rays, the
// list of probes, `params`, and how probes are looked up.
#ifndef LUMIVOX_PROBES_BOUNCE
#define LUMIVOX_PROBES_BOUNCE

#include "gi/probes/hit_surface.glsl"
#include "gi/probes/rays.glsl"

void main() {
    uint group = gl_WorkGroupID.x + gl_WorkGroupID.y * 65535u;
    uint index = group * 64u + gl_LocalInvocationID.x;
    if (index >= params.all) return;
    uvec2 row = probe_list[params.first_probe + index / params.ray_count];
    uint probe = row.x, own = index % params.ray_count;
    ivec2 texel = texel_of_ray(probe * params.ray_count + own);
    uvec4 hit = texelFetch(usampler2D(ray_hits, nearest_clamp), texel, 0);
    vec3 light = vec3(0.0);
    if (hit.x != NO_TRIANGLE) {
        vec3 direction = turn_of(row.y) * ray_of_set(own);
        PathVertex v = unpack_hit(hit, probe_places[probe].xyz, direction);
        if (v.albedo != vec3(0.0))
            light = v.albedo / PI * light_of_probes(v.position, v.geometric_normal, v.normal).rgb;
    }
    imageStore(ray_light, texel_of_ray(index), vec4(light, 0.0));
}

#endif
