#version 460
#extension GL_GOOGLE_include_directive : require
// probes.light_voxels: the radiance that each ray brings: that of the voxel that it hits, or the
// environment. A thread a ray.
layout(local_size_x = 64) in;

#define SPACE_BINDING 0
#define SPACE_CONSTANT 0

layout(set = 1, binding = 3) uniform texture2D ray_set;
layout(set = 1, binding = 4) uniform utexture2D ray_hits;
layout(set = 1, binding = 5, rgba32f) uniform restrict writeonly image2D ray_light;
#define LIST_BINDING 6
#include "gi/probes/list.glsl"

layout(push_constant) uniform VoxelRayParams {
    vec4 grid;           // xyz: smallest corner of the grid; w: edge of its voxels [m]
    uint resolution;     // edge of the grid [voxels]
    uint ray_count;      // of a probe
    uint first_probe;    // of the list
    uint all;            // rays
} params;

#include "shared/environment.glsl"
#include "gi/shared/voxel/trace/lit_grid.glsl"
#include "gi/probes/hit.glsl"
#include "gi/probes/rays.glsl"

void main() {
    uint group = gl_WorkGroupID.x + gl_WorkGroupID.y * 65535u;
    uint index = group * 64u + gl_LocalInvocationID.x;
    if (index >= params.all) return;
    uvec2 row = probe_list[params.first_probe + index / params.ray_count];
    uint own = index % params.ray_count;
    ivec2 texel = texel_of_ray(row.x * params.ray_count + own);
    uint hit = texelFetch(usampler2D(ray_hits, nearest_clamp), texel, 0).x;
    vec3 direction = turn_of(row.y) * ray_of_set(own);
    vec4 light;
    if (hit == 0xffffffffu)
        light = vec4(environment_of_ray(direction, params.ray_count), 1.0);
    else
        light = vec4(radiance_along(hit & HIT_TRIANGLE, direction), 0.0);
    imageStore(ray_light, texel_of_ray(index), light);
}
