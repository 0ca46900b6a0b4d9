#version 460
#extension GL_GOOGLE_include_directive : require
// probes.trace_voxels: the voxel that each ray of some probes hits first, and the surface that it
// has there. A thread a ray.
layout(local_size_x = 64) in;

#define SPACE_BINDING 0
#define SPACE_CONSTANT 0

layout(constant_id = 1) const uint KEEPS = 0;   // 1: what rays have met stays where nothing moved

// w: 1 where the probe stands elsewhere than when its rays were traced
layout(std430, set = 1, binding = 3) restrict readonly buffer ProbePlaces { vec4 probe_places[]; };
layout(set = 1, binding = 4) uniform texture2D ray_set;
// as gi/probes/hit_surface.glsl packs it, but for a voxel's number in place of the triangle's
layout(set = 1, binding = 5, rgba32ui) uniform restrict uimage2D ray_hits;
#define LIST_BINDING 6
#include "gi/probes/list.glsl"

layout(push_constant) uniform VoxelTraceParams {
    vec4 low;            // xyz: the box in which something has moved [m]
    vec4 high;
    vec4 grid;           // xyz: smallest corner of the grid; w: edge of its voxels [m]
    uint resolution;     // edge of the grid [voxels]
    uint ray_count;      // of a probe
    uint first_probe;    // of the list
    uint all;            // rays
} params;

#include "shared/frame.glsl"
#include "gi/probes/voxels.glsl"
#include "gi/probes/hit.glsl"
#include "gi/probes/rays.glsl"
#include "gi/probes/touches.glsl"

// The normal of what a ray sees of a voxel: of its plane, or of the face towards the ray.
vec3 seen_normal(Voxel voxel, vec3 direction) {
    vec3 normal = unpack_mean_normal(voxel.normal);
    if (!is_one_plane(normal)) {
        vec3 along = abs(direction);
        float most = max(along.x, max(along.y, along.z));
        normal = vec3(greaterThanEqual(along, vec3(most))) * direction;
    }
    normal = normalize(normal);
    return dot(normal, direction) > 0.0 ? -normal : normal;
}

void main() {
    uint group = gl_WorkGroupID.x + gl_WorkGroupID.y * 65535u;
    uint index = group * 64u + gl_LocalInvocationID.x;
    if (index >= params.all) return;
    uvec2 probe = probe_list[params.first_probe + index / params.ray_count];
    uint own = index % params.ray_count;
    ivec2 texel = texel_of_ray(probe.x * params.ray_count + own);
    vec3 direction = turn_of(probe.y) * ray_of_set(own);
    vec4 place = probe_places[probe.x];
    if (KEEPS != 0u) {
        float distance = uintBitsToFloat(imageLoad(ray_hits, texel).w);
        if (place.w == 0.0 && !touches_box(place.xyz, direction, distance)) return;
    }
    VoxelHit hit = voxel_along(place.xyz, direction, probe.x, own);
    uvec4 packed = uvec4(0xffffffffu, 0u, 0u, floatBitsToUint(hit.distance));
    if (hit.slot >= 0) {
        Voxel voxel = surface_of(uint(hit.slot));
        vec3 root = sqrt(unpack_albedo(voxel.albedo));
        uvec3 albedo = uvec3(round(root * vec3(2047.0, 2047.0, 1023.0)));
        packed.x = uint(hit.slot) | HIT_IS_FLAT;
        packed.y = pack_unit(seen_normal(voxel, direction));
        packed.z = albedo.r | albedo.g << 11 | albedo.b << 22;
    }
    imageStore(ray_hits, texel, packed);
}
