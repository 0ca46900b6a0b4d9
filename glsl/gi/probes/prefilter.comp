#version 460
#extension GL_GOOGLE_include_directive : require
// light_field.prefilter: the light of one level, averaged over a lobe around each texel's direction
// or over all directions that a surface has in front of it, by the cosine. A thread a texel.
layout(local_size_x = 8, local_size_y = 8) in;

layout(set = 1, binding = 0) uniform utexture2D field_radiance;
layout(set = 1, binding = 1, r32ui) uniform restrict writeonly uimage2D field_prefiltered;

layout(push_constant) uniform PrefilterParams {
    uint edge;           // of a map of radiance [texels]
    uint columns;        // maps beside each other in the images
    uint rows;           // and below each other
    uint probe_count;
    uint level;
    uint sample_count;
    float roughness;     // of the lobe
} params;

#include "shared/frame.glsl"
#include "shared/directions.glsl"
#include "shared/ggx.glsl"
#include "gi/probes/field_texels.glsl"
#include "gi/probes/prefiltered.glsl"

const float GOLDEN_ANGLE = 2.399963229728653;

vec3 radiance_towards(uint probe, vec3 direction) {
    vec2 at = (octahedral_from_unit(direction) * 0.5 + 0.5) * float(params.edge);
    ivec2 texel = clamp(ivec2(at), ivec2(0), ivec2(params.edge - 1u));
    ivec2 map = field_map(probe, params.columns, params.edge);
    return unpack_rgbe(
        texelFetch(usampler2D(field_radiance, nearest_clamp), map + texel, 0).r);
}

void main() {
    int edge = edge_of_level(params.level, int(params.edge));
    ivec2 texel = ivec2(gl_GlobalInvocationID.xy), map = texel / edge;
    uint probe = uint(map.x) + uint(map.y) * params.columns;
    if (map.x >= int(params.columns) || probe >= params.probe_count) return;
    texel -= map * edge;
    mat3 around = frame_around(direction_of_texel(vec2(texel), uint(edge)));
    float a2 = pow(ggx_alpha(params.roughness), 2.0);
    vec3 sum = vec3(0.0);
    float weights = 0.0;
    for (uint i = 0u; i < params.sample_count; ++i) {
        float u = (float(i) + 0.5) / float(params.sample_count), phi = float(i) * GOLDEN_ANGLE;
        float weight = 1.0;
        vec3 direction;
        if (params.level == ALL_SIDES) {
            direction = hemisphere_direction(around, u, phi);
        } else {
            // GGX facets around the direction, which is that of the eye too.
            float cos2 = (1.0 - u) / (1.0 + (a2 - 1.0) * u), sine = sqrt(1.0 - cos2);
            weight = 2.0 * cos2 - 1.0;
            if (weight <= 0.0) continue;
            float across = 2.0 * sqrt(cos2) * sine;
            direction = around * vec3(across * cos(phi), across * sin(phi), weight);
        }
        sum += weight * radiance_towards(probe, direction);
        weights += weight;
    }
    ivec2 first = map_in_level(
        probe, params.level, params.columns, params.rows, int(params.edge));
    imageStore(
        field_prefiltered, first + texel, uvec4(pack_rgbe(sum / max(weights, 1e-30))));
}
