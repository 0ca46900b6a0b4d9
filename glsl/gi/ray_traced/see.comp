#version 460
#extension GL_GOOGLE_include_directive : require
// ray_traced.see: what is seen along given lines of sight: the light of paths from what each meets.
layout(local_size_x = 64) in;

#include "gi/shared/paths/bindings.glsl"
#include "shared/sight.glsl"

layout(std430, set = 1, binding = 9) restrict readonly buffer SightRays { SightRay sight_rays[]; };
layout(std430, set = 1, binding = 10) restrict buffer Sights { Sight sights[]; };

#include "gi/ray_traced/params.glsl"

#include "shared/frame.glsl"
#define SPACE_BINDING 11
#include "gi/shared/paths/path.glsl"

void main() {
    uint group = gl_WorkGroupID.x + gl_WorkGroupID.y * 65535u;
    uint index = group * 64u + gl_LocalInvocationID.x;
    if (index >= frame.size_px.x * frame.size_px.y) return;
    SightRay ray = sight_rays[index];
    vec3 direction = ray.direction.xyz;
    if (direction == vec3(0.0)) return;
    RayHit hit = traverse(
        ray.origin.xyz, direction, ray.origin.w, NO_TRIANGLE, NO_TRIANGLE, false);
    if (hit.triangle == NO_TRIANGLE) {
        sights[index].light = vec4(0.0, 0.0, 0.0, 1.0);
        return;
    }
    PathVertex seen = vertex_at(hit.triangle, hit.at, -direction);
    ivec2 pixel = ivec2(index % frame.size_px.x, index / frame.size_px.x);
    vec3 sum = params.first_ray == 0u ? seen.emission : sights[index].light.rgb;
    for (uint i = params.first_ray; i < params.end_ray; ++i) {
        bool escaped;
        uvec2 which = uvec2(frame.walk.x * params.ray_count + i, params.ray_count);
        sum += light_from(seen, 1u, vec3(0.0), pixel, which, params.bounces, 0.0, escaped)
            / float(params.ray_count);
    }
    sights[index].light = vec4(sum, 0.0);
}
