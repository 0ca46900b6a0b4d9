#version 460
#extension GL_GOOGLE_include_directive : require
// probes.light: the radiance that each ray brings: what its hit emits, and reflects of the lights,
// or the environment. A thread a ray.
layout(local_size_x = 64) in;

#include "gi/shared/paths/bindings.glsl"

layout(set = 1, binding = 9) uniform texture2D ray_set;
layout(set = 1, binding = 10) uniform utexture2D ray_hits;
layout(set = 1, binding = 11, rgba32f) uniform restrict writeonly image2D ray_light;
layout(std430, set = 1, binding = 12) restrict readonly buffer ProbePlaces { vec4 probe_places[]; };
#define LIST_BINDING 13
#include "gi/probes/list.glsl"

layout(push_constant) uniform RayParams {
    uint ray_count;      // of a probe
    uint first_probe;    // of the list
    uint all;            // rays
} params;

#include "gi/shared/paths/path.glsl"
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
    vec3 direction = turn_of(row.y) * ray_of_set(own);
    if (hit.x == NO_TRIANGLE) {
        vec3 sky = environment_of_ray(direction, params.ray_count);
        imageStore(ray_light, texel_of_ray(index), vec4(sky, 1.0));
        return;
    }
    PathVertex v = unpack_hit(hit, probe_places[probe].xyz, direction);
    // What reflects the light of what emits is a bounce.
    vec3 light = v.emission + light_straight(v, frame.size_px.z, 0u, vec3(0.0));
    imageStore(ray_light, texel_of_ray(index), vec4(light, 0.0));
}
