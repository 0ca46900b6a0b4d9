#version 460
#extension GL_GOOGLE_include_directive : require
// cascades.bounce: the radiance that each ray brings of the light that probes have: what its hit
// reflects of it, diffusely. A thread a ray.
layout(local_size_x = 64) in;

#include "gi/shared/paths/bindings.glsl"

layout(set = 1, binding = 9) uniform texture2D ray_set;
layout(set = 1, binding = 10) uniform utexture2D ray_hits;
layout(set = 1, binding = 11, rgba32f) uniform restrict writeonly image2D ray_light;

#include "gi/probes/lookup_row.glsl"
#define LIST_BINDING 19
#include "gi/probes/list.glsl"

layout(push_constant) uniform LevelBounceParams {
    uint level_count;
    uint ray_count;      // of a probe
    uint first_probe;    // of the list
    uint all;            // rays
} params;

#include "gi/probes/hit_surface.glsl"
#define LOOKUP_BINDING 12
#define LOOKUP_CONSTANT 6
#include "gi/probes/cascades/lookup.glsl"
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
            light = v.albedo / PI * light_of_levels(v.position, v.geometric_normal, v.normal).rgb;
    }
    imageStore(ray_light, texel_of_ray(index), vec4(light, 0.0));
}
