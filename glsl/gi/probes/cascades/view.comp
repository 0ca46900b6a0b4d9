#version 460
#extension GL_GOOGLE_include_directive : require
// cascades.view: probes of a level as spheres as the camera sees them, in front of surfaces by what
// they look up. A thread a pixel.
layout(local_size_x = 8, local_size_y = 8) in;

layout(set = 1, binding = 0) uniform texture2D view_depth;
layout(set = 1, binding = 1) uniform utexture2D normals;
layout(set = 1, binding = 2, rgba32f) uniform restrict writeonly image2D seen;

#include "gi/probes/lookup_row.glsl"

layout(push_constant) uniform LevelViewParams {
    float radius_m;       // of a sphere
    float reach;          // the farthest that a probe sees [cells]
    uint view;            // one of gi::probes::view::LEVEL_VIEWS, by its place in VIEWS
    uint level;
    uint level_count;
} params;

#include "shared/gbuffer.glsl"
#define LOOKUP_BINDING 3
#define LOOKUP_CONSTANT 0
#include "gi/probes/cascades/lookup.glsl"

const uint IRRADIANCE = 0u, DISTANCES = 1u, SIGHT = 3u;

// What a sphere shows where its normal points to `normal`.
vec4 shown_of_probe(uint probe, vec3 normal) {
    if (params.view == DISTANCES)
        return map_at(probe_moments, probe, MOMENT_TEXELS, normal).rrra / params.reach;
    return light_of_probe(probe, probe_places[probe].xyz, normal);
}

#include "gi/probes/view.glsl"

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, ivec2(frame.size_px.xy)))) return;
    choose_level(params.level);
    imageStore(seen, pixel, shown_of_pixel(pixel));
}
