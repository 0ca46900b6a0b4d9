#version 460
#extension GL_GOOGLE_include_directive : require
// light_field.light: the radiance of the surface that each texel sees. A thread a texel.
layout(local_size_x = 8, local_size_y = 8) in;

#include "gi/shared/paths/bindings.glsl"

layout(set = 1, binding = 9) uniform utexture2D field_hits;
layout(set = 1, binding = 10, r32ui) uniform restrict writeonly uimage2D field_radiance;

#include "gi/probes/lookup_row.glsl"

layout(push_constant) uniform FieldLightParams {
    LookupRow lookup;
    uint edge;          // of a map [texels]
    uint columns;       // maps beside each other in the images
    uint probe_count;
} params;

#include "gi/shared/paths/path.glsl"
#define LOOKUP_BINDING 11
#define LOOKUP_CONSTANT 6
#define TRACES
#include "gi/probes/lookup.glsl"
#define REFLECTS_CONSTANT 12
#include "gi/probes/light_field/reflected.glsl"
#include "gi/probes/light_field/texels.glsl"

void main() {
    ivec2 texel = ivec2(gl_GlobalInvocationID.xy);
    uint columns = params.columns, edge = params.edge;
    bool is_there = texel.x < int(columns * edge)
        && probe_of_texel(texel, columns, edge) < params.probe_count;
    if (!is_there) return;
    uvec2 hit = texelFetch(usampler2D(field_hits, nearest_clamp), texel, 0).rg;
    vec3 light = frame.environment.rgb;
    if (hit.x != NO_TRIANGLE)
        light = light_of_hit(hit.x, unpackUnorm2x16(hit.y),
            direction_of_texel(vec2(uvec2(texel) % edge), edge));
    imageStore(field_radiance, texel, uvec4(pack_rgbe(light)));
}
