#version 460
#extension GL_GOOGLE_include_directive : require
// probes.view: probes as spheres as the camera sees them, in front of surfaces by what they look
// up; or the images of maps. A thread a pixel.
layout(local_size_x = 8, local_size_y = 8) in;

layout(set = 1, binding = 0) uniform texture2D view_depth;
layout(set = 1, binding = 1) uniform utexture2D normals;
layout(set = 1, binding = 2, rgba32f) uniform restrict writeonly image2D seen;

#include "gi/probes/lookup_row.glsl"

layout(push_constant) uniform ViewParams {
    LookupRow lookup;
    float radius_m;       // of a sphere
    float farthest_m;     // that a probe moves
    float reach;          // the farthest that a probe sees [cells]
    uint view;            // one of gi::probes::view::VIEWS
} params;

#include "shared/gbuffer.glsl"
#define LOOKUP_BINDING 3
#define LOOKUP_CONSTANT 0
#include "gi/probes/lookup.glsl"

const uint IRRADIANCE = 0u, DISTANCES = 1u, MOVES = 2u, SIGHT = 3u, IRRADIANCE_ATLAS = 4u;

// What a sphere shows where its normal points to `normal`.
vec4 shown_of_probe(uint probe, vec3 normal) {
    vec3 place = probe_places[probe].xyz;
    if (params.view == DISTANCES)
        return map_at(probe_moments, probe, MOMENT_TEXELS, normal).rrra / params.reach;
    if (params.view == MOVES) {
        uvec3 counts = params.lookup.counts.xyz;
        uint row = probe / counts.x;
        vec3 at = vec3(probe % counts.x, row % counts.y, row / counts.y);
        vec3 home = params.lookup.first.xyz + params.lookup.spacing.xyz * at;
        return vec4((place - home) / params.farthest_m, 1.0);
    }
    return light_of_probe(probe, place, normal);
}

#include "gi/probes/view.glsl"

// A texel of an image of maps, which fills the picture as far as its shape allows.
vec4 shown_of_atlas(ivec2 pixel) {
    bool is_light = params.view == IRRADIANCE_ATLAS;
    ivec2 size = is_light ? textureSize(sampler2D(probe_irradiance, nearest_clamp), 0)
                          : textureSize(sampler2D(probe_moments, nearest_clamp), 0);
    vec2 picture = vec2(frame.size_px.xy), texels = vec2(size) / picture;
    ivec2 texel = ivec2((vec2(pixel) + 0.5) * max(texels.x, texels.y));
    if (any(greaterThanEqual(texel, size))) return vec4(0.0);
    if (!is_light) {
        vec2 moments = texelFetch(sampler2D(probe_moments, nearest_clamp), texel, 0).rg;
        float deviation = sqrt(abs(moments.y - moments.x * moments.x));
        return vec4(vec2(moments.x, deviation) / params.reach, 0.0, 1.0);
    }
    ivec2 map = texel / int(IRRADIANCE_TEXELS + 2u);
    uint probe = uint(map.x) + uint(map.y) * params.lookup.columns;
    uvec3 counts = params.lookup.counts.xyz;
    if (probe >= counts.x * counts.y * counts.z) return vec4(0.0);
    vec4 light = texelFetch(sampler2D(probe_irradiance, nearest_clamp), texel, 0);
    return vec4(light.rgb * probe_scales[probe], light.a);
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, ivec2(frame.size_px.xy)))) return;
    bool is_atlas = params.view >= IRRADIANCE_ATLAS;
    imageStore(seen, pixel, is_atlas ? shown_of_atlas(pixel) : shown_of_pixel(pixel));
}
