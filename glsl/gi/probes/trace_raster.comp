#version 460
#extension GL_GOOGLE_include_directive : require
// probes.trace_raster: what each ray of some probes meets of what was drawn around them. A thread a
// ray.
layout(local_size_x = 64) in;

#define RASTER_BINDING 0
#define RASTER_CONSTANT 0

layout(constant_id = 1) const uint KEEPS = 0;   // 1: what rays have met stays where nothing moved

// w: 1 where the probe stands elsewhere than when its rays were traced
layout(std430, set = 1, binding = 1) restrict readonly buffer ProbePlaces { vec4 probe_places[]; };
layout(set = 1, binding = 2) uniform texture2D ray_set;
layout(set = 1, binding = 3, rgba32ui) uniform restrict writeonly uimage2D ray_hits;
#define LIST_BINDING 4
#include "gi/probes/list.glsl"

layout(push_constant) uniform RasterRayParams {
    vec4 low;            // xyz: the box in which something has moved [m]
    vec4 high;
    uint ray_count;      // of a probe
    uint first_probe;    // of the list
    uint all;            // rays
} params;

#include "gi/probes/raster.glsl"
#include "gi/probes/rays.glsl"
#include "gi/probes/touches.glsl"

void main() {
    uint group = gl_WorkGroupID.x + gl_WorkGroupID.y * 65535u;
    uint index = group * 64u + gl_LocalInvocationID.x;
    if (index >= params.all) return;
    uint own = index % params.ray_count, drawn = index / params.ray_count;
    uvec2 probe = probe_list[params.first_probe + drawn];
    vec3 direction = turn_of(probe.y) * ray_of_set(own);
    vec4 place = probe_places[probe.x];
    if (KEEPS != 0u && place.w == 0.0) {
        float far = uintBitsToFloat(0x7f800000u);
        if (!touches_box(place.xyz, drawn_along(direction), far)) return;
    }
    RasterHit hit = raster_along(drawn, place.xyz, direction);
    // As rays through triangles leave it: negative where it is still to be packed.
    float distance = hit.triangle == NOTHING_SEEN ? hit.distance : -hit.distance;
    imageStore(ray_hits, texel_of_ray(probe.x * params.ray_count + own),
        uvec4(hit.triangle, floatBitsToUint(hit.at), floatBitsToUint(distance)));
}
