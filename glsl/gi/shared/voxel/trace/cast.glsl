// store.cast: what given rays bring through the voxels of a space. A thread a ray.
layout(local_size_x = 64) in;

#include "gi/shared/cast.glsl"

layout(std430, set = 1, binding = 0) restrict readonly buffer CastRays { CastRay cast_rays[]; };
layout(std430, set = 1, binding = 1) restrict writeonly buffer CastHits { CastHit cast_hits[]; };

layout(push_constant) uniform CastParams {
    vec4 grid;         // xyz: smallest corner of the space; w: edge of its finest voxels [m]
    uint resolution;   // edge of the space [voxels]
    uint ray_count;
    float contour_slack;   // [voxels]
    uint family;       // rays of one, over all directions
} params;

#include "shared/environment.glsl"
#include "gi/shared/voxel/trace/trace.glsl"

void main() {
    uint group = gl_WorkGroupID.x + gl_WorkGroupID.y * 65535u;
    uint index = group * 64u + gl_LocalInvocationID.x;
    if (index >= params.ray_count) return;
    CastRay ray = cast_rays[index];
    if (ray.direction.xyz == vec3(0.0)) return;
    vec3 origin = (ray.origin.xyz - params.grid.xyz) / params.grid.w;
    vec3 direction = ray.direction.xyz;
    // It starts in the air: no voxel is the receiver itself.
    TraceSettings settings = TraceSettings(params.resolution, -1.0, params.contour_slack,
        floatBitsToUint(ray.origin.w), floatBitsToUint(ray.direction.w));
    float entry;
    int slot = trace(origin, direction, vec3(0.0), vec3(0.0), settings, entry);
    vec4 light;
    if (slot < 0) {
        vec3 radiance = environment_of_ray(direction, params.family);
        light = vec4(radiance, uintBitsToFloat(0x7f800000u));
    } else {
        float half_edge = 0.5 * voxel_edge(origin + direction * entry);
        light = vec4(radiance_along(uint(slot), direction), (entry + half_edge) * params.grid.w);
    }
    cast_hits[index].light = light;
}
