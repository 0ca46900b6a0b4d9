#version 460
#extension GL_GOOGLE_include_directive : require
// probes.moments: mean and mean square of the distance (cells) that a probe sees by direction, over
// rays of each texel's own square. A thread a texel.
layout(local_size_x = 64) in;

#include "render/bvh/bindings.glsl"

layout(std430, set = 1, binding = 5) restrict readonly buffer ProbePlaces { vec4 probe_places[]; };
layout(set = 1, binding = 6, rg16f) uniform restrict writeonly image2D probe_moments;

#include "gi/probes/moments.glsl"
#include "render/bvh/traverse.glsl"

// Rays along each axis of a texel.
const uint RAYS = 2u;

void main() {
    uint index = moment_texel();
    if (index >= params.all) return;
    vec3 origin = probe_places[probe_of(index)].xyz;
    vec2 place = vec2(place_of(index)), sum = vec2(0.0);
    for (uint i = 0u; i < RAYS * RAYS; ++i) {
        vec2 within = (vec2(i % RAYS, i / RAYS) + 0.5) / float(RAYS) - 0.5;
        vec3 direction = direction_of_texel(place + within, params.edge);
        sum += moments_of(closest_hit(origin, direction, NO_TRIANGLE).t);
    }
    store_moments(index, sum / float(RAYS * RAYS));
}
