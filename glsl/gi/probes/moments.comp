#version 460
#extension GL_GOOGLE_include_directive : require
// probes.moments: mean and mean square of the distance (cells) that some probes see by direction,
// over rays of each texel's own square. A thread a texel.
layout(local_size_x = 64) in;

#include "render/bvh/bindings.glsl"

layout(constant_id = 3) const uint KEEPS = 0;   // 1: texels stay whose rays see nothing that moved

layout(std430, set = 1, binding = 5) restrict readonly buffer ProbePlaces { vec4 probe_places[]; };
layout(set = 1, binding = 6, rg16f) uniform restrict writeonly image2D probe_moments;
#define LIST_BINDING 7

#include "gi/probes/moments.glsl"
#include "gi/probes/touches.glsl"
#include "render/bvh/traverse.glsl"

// Rays along each axis of a texel.
const uint RAYS = 2u;

vec3 ray_of_texel(ivec2 texel, uint ray) {
    vec2 within = (vec2(ray % RAYS, ray / RAYS) + 0.5) / float(RAYS) - 0.5;
    return direction_of_texel(vec2(texel) + within, params.edge);
}

void main() {
    uint index = moment_texel();
    if (index >= params.all) return;
    vec4 place = probe_places[probe_of(index).x];
    ivec2 texel = place_of(index);
    if (KEEPS != 0u) {
        float far_m = params.reach * params.cell_m;
        bool is_changed = place.w != 0.0;
        for (uint i = 0u; i < RAYS * RAYS; ++i)
            is_changed = is_changed || touches_box(place.xyz, ray_of_texel(texel, i), far_m);
        if (!is_changed) return;
    }
    vec2 sum = vec2(0.0);
    for (uint i = 0u; i < RAYS * RAYS; ++i)
        sum += moments_of(closest_hit(place.xyz, ray_of_texel(texel, i), NO_TRIANGLE).t);
    store_moments(index, sum / float(RAYS * RAYS));
}
