#version 460
#extension GL_GOOGLE_include_directive : require
// probes.aim: the rays of some probes, to be cast through what another technique keeps. A thread a
// ray. With an `edge` they are those of the texels of their maps of distances.
layout(local_size_x = 64) in;

layout(constant_id = 0) const uint KEEPS = 0;   // 1: texels stay that see nothing of what moved

#include "gi/shared/cast.glsl"

// w: 1 where the probe stands elsewhere than when its rays were cast
layout(std430, set = 1, binding = 0) restrict readonly buffer ProbePlaces { vec4 probe_places[]; };
layout(set = 1, binding = 1) uniform texture2D ray_set;
layout(std430, set = 1, binding = 2) restrict writeonly buffer CastRays { CastRay cast_rays[]; };
#define LIST_BINDING 3
#include "gi/probes/list.glsl"

layout(push_constant) uniform AimParams {
    vec4 low;            // xyz: the box in which something has moved [m]
    vec4 high;
    uint ray_count;      // of a probe
    uint first_probe;    // of the list
    uint all;            // rays
    uint edge;           // of a map of distances [texels]; 0: the rays of the set
    float cell_m;        // the smallest spacing
    float reach;         // what counts as the farthest [cells]
} params;

#include "shared/frame.glsl"
#include "gi/probes/rays.glsl"
#include "gi/probes/sees_moved.glsl"

void main() {
    uint group = gl_WorkGroupID.x + gl_WorkGroupID.y * 65535u;
    uint index = group * 64u + gl_LocalInvocationID.x;
    if (index >= params.all) return;
    uint own = index % params.ray_count;
    uvec2 probe = probe_list[params.first_probe + index / params.ray_count];
    vec4 place = probe_places[probe.x];
    vec3 direction;
    if (params.edge == 0u) {
        direction = turn_of(probe.y) * ray_of_set(own);
    } else {
        uint texel = own / RAYS_OF_TEXEL;
        ivec2 at = ivec2(texel % params.edge, texel / params.edge);
        direction = ray_of_texel(at, own % RAYS_OF_TEXEL, params.edge);
        // What stays is not cast.
        if (KEEPS != 0u && !sees_moved(place, at, params.edge)) direction = vec3(0.0);
    }
    cast_rays[index] = CastRay(vec4(place.xyz, uintBitsToFloat(probe.y)),
        vec4(direction, uintBitsToFloat(own)));
}
