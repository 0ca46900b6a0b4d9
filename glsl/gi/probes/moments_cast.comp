#version 460
#extension GL_GOOGLE_include_directive : require
// probes.moments_cast: mean and mean square of the distance (cells) that some probes see by
// direction, over rays that were cast through what another technique keeps. A thread a texel.
layout(local_size_x = 64) in;

layout(constant_id = 0) const uint KEEPS = 0;   // 1: texels stay whose rays see nothing that moved

#include "gi/shared/cast.glsl"

layout(std430, set = 1, binding = 0) restrict readonly buffer CastHits { CastHit cast_hits[]; };
layout(set = 1, binding = 1, rg16f) uniform restrict writeonly image2D probe_moments;
// w: 1 where the probe stands elsewhere than when its rays were cast
layout(std430, set = 1, binding = 2) restrict readonly buffer ProbePlaces { vec4 probe_places[]; };
#define LIST_BINDING 3

#include "gi/probes/moments.glsl"
#include "gi/probes/moment_rays.glsl"
#include "gi/probes/sees_moved.glsl"

void main() {
    uint index = moment_texel();
    if (index >= params.all) return;
    vec4 place = probe_places[probe_of(index).x];
    if (KEEPS != 0u && !sees_moved(place, place_of(index), params.edge)) return;
    vec2 sum = vec2(0.0);
    for (uint i = 0u; i < RAYS_OF_TEXEL; ++i)
        sum += moments_of(cast_hits[RAYS_OF_TEXEL * index + i].light.w);
    store_moments(index, sum / float(RAYS_OF_TEXEL));
}
