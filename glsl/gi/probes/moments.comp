#version 460
#extension GL_GOOGLE_include_directive : require
// probes.moments: mean and mean square of the distance (cells) that some probes see by direction,
// over rays of each texel's own square. A thread a texel.
layout(local_size_x = 64) in;

#ifdef VOXELS
#define SPACE_BINDING 0
#define SPACE_CONSTANT 0
#define FIRST_BINDING 3
#define KEEPS_CONSTANT 1
#elif defined RASTER
#define RASTER_BINDING 0
#define RASTER_CONSTANT 0
#define FIRST_BINDING 1
#define KEEPS_CONSTANT 1
#else
#include "render/bvh/bindings.glsl"
#define FIRST_BINDING 5
#define KEEPS_CONSTANT 3
#endif

// 1: texels stay whose rays see nothing that moved
layout(constant_id = KEEPS_CONSTANT) const uint KEEPS = 0;

layout(std430, set = 1, binding = FIRST_BINDING) restrict readonly buffer ProbePlaces {
    vec4 probe_places[];
};
layout(set = 1, binding = FIRST_BINDING + 1, rg16f) uniform restrict writeonly image2D
    probe_moments;
#define LIST_BINDING FIRST_BINDING + 2

#include "gi/probes/moments.glsl"
#include "gi/probes/moment_rays.glsl"
#ifdef VOXELS
#include "gi/probes/voxels.glsl"
#elif defined RASTER
#include "gi/probes/raster.glsl"
#else
#include "render/bvh/traverse.glsl"
#endif
#include "gi/probes/sees_moved.glsl"

// How far ray `ray` of a texel sees [m].
float distance_along(vec3 place, vec3 direction, uint texel, uint ray) {
#ifdef VOXELS
    return voxel_along(place, direction, texel, ray).distance;
#elif defined RASTER
    return raster_along(texel / (params.edge * params.edge), place, direction).distance;
#else
    return closest_hit(place, direction, NO_TRIANGLE).t;
#endif
}

void main() {
    uint index = moment_texel();
    if (index >= params.all) return;
    vec4 place = probe_places[probe_of(index).x];
    ivec2 texel = place_of(index);
    if (KEEPS != 0u && !sees_moved(place, texel, params.edge)) return;
    vec2 sum = vec2(0.0);
    for (uint i = 0u; i < RAYS_OF_TEXEL; ++i)
        sum += moments_of(distance_along(place.xyz, ray_of_texel(texel, i, params.edge), index, i));
    store_moments(index, sum / float(RAYS_OF_TEXEL));
}
