#version 460
#extension GL_GOOGLE_include_directive : require
// probes.moments: mean and mean square of the distance (cells) that a probe sees by direction, over
// rays of each texel's own square. A thread a texel.
layout(local_size_x = 64) in;

#include "render/bvh/bindings.glsl"

layout(std430, set = 1, binding = 5) restrict readonly buffer ProbePlaces { vec4 probe_places[]; };
layout(set = 1, binding = 6, rg16f) uniform restrict writeonly image2D probe_moments;

layout(push_constant) uniform MomentParams {
    uint columns;
    uint edge;         // of a map [texels]
    uint all;          // texels of all probes
    float cell_m;      // the smallest spacing
    float reach;       // what counts as the farthest [cells]
} params;

#include "render/bvh/traverse.glsl"
#include "gi/probes/atlas.glsl"

// Rays along each axis of a texel.
const uint RAYS = 2u;

void main() {
    uint group = gl_WorkGroupID.x + gl_WorkGroupID.y * 65535u;
    uint index = group * 64u + gl_LocalInvocationID.x;
    if (index >= params.all) return;
    uint texel_count = params.edge * params.edge, probe = index / texel_count;
    uint texel = index % texel_count;
    ivec2 place = ivec2(texel % params.edge, texel / params.edge);
    vec2 sum = vec2(0.0);
    for (uint i = 0u; i < RAYS * RAYS; ++i) {
        vec2 within = (vec2(i % RAYS, i / RAYS) + 0.5) / float(RAYS) - 0.5;
        vec3 direction = direction_of_texel(vec2(place) + within, params.edge);
        RayHit hit = closest_hit(probe_places[probe].xyz, direction, NO_TRIANGLE);
        float distance = hit.triangle == NO_TRIANGLE
            ? params.reach
            : min(hit.t / params.cell_m, params.reach);
        sum += vec2(distance, distance * distance);
    }
    vec4 moments = vec4(sum / float(RAYS * RAYS), 0.0, 0.0);
    ivec2 map = map_of(probe, params.columns, params.edge);
    imageStore(probe_moments, map + 1 + place, moments);
    ivec2 copies[3] = border_of(place, int(params.edge));
    for (int i = 0; i < 3; ++i)
        if (copies[i].x >= 0) imageStore(probe_moments, map + copies[i], moments);
}
