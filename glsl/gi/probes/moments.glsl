// Where the moments of distances are kept. The including pass declares `probe_moments` and
// LIST_BINDING.
#ifndef LUMIVOX_PROBES_MOMENTS
#define LUMIVOX_PROBES_MOMENTS

#include "gi/probes/atlas.glsl"
#include "gi/probes/list.glsl"

layout(push_constant) uniform MomentParams {
    vec4 low;            // xyz: the box in which something has moved [m]
    vec4 high;
    vec4 grid;           // xyz: smallest corner of the grid of voxels; w: their edge [m]
    uint resolution;     // edge of the grid [voxels]
    uint columns;
    uint edge;           // of a map [texels]
    uint first_probe;    // of the list
    uint all;            // texels
    uint ray_count;      // of a probe
    float cell_m;        // the smallest spacing
    float reach;         // what counts as the farthest [cells]
} params;

// Which of all texels the thread has.
uint moment_texel() {
    uint group = gl_WorkGroupID.x + gl_WorkGroupID.y * 65535u;
    return group * gl_WorkGroupSize.x + gl_LocalInvocationID.x;
}

// Number of a texel's probe, and the seed of its turn.
uvec2 probe_of(uint index) {
    return probe_list[params.first_probe + index / (params.edge * params.edge)];
}

ivec2 place_of(uint index) {
    uint texel = index % (params.edge * params.edge);
    return ivec2(texel % params.edge, texel / params.edge);
}

// What a distance [m], infinite where nothing is met, adds to both moments.
vec2 moments_of(float distance) {
    float cells = min(distance / params.cell_m, params.reach);
    return vec2(cells, cells * cells);
}

void store_moments(uint index, vec2 moments) {
    ivec2 map = map_of(probe_of(index).x, params.columns, params.edge), place = place_of(index);
    imageStore(probe_moments, map + 1 + place, vec4(moments, 0.0, 0.0));
    ivec2 copies[3] = border_of(place, int(params.edge));
    for (int i = 0; i < 3; ++i)
        if (copies[i].x >= 0) imageStore(probe_moments, map + copies[i], vec4(moments, 0.0, 0.0));
}

#endif
