#version 460
#extension GL_GOOGLE_include_directive : require
// probes.gather: irradiance and ambient visibility from the eight probes around each surface. A
// thread a pixel.
layout(local_size_x = 8, local_size_y = 8) in;

layout(set = 1, binding = 0) uniform texture2D view_depth;
layout(set = 1, binding = 1) uniform utexture2D normals;
layout(set = 1, binding = 2, rgba32f) uniform restrict writeonly image2D indirect_diffuse;

#include "gi/probes/lookup_row.glsl"

layout(push_constant) uniform LookupParams {
    LookupRow lookup;
} params;

#include "shared/receiver.glsl"
#define LOOKUP_BINDING 3
#define LOOKUP_CONSTANT 0
#include "gi/probes/lookup.glsl"

void main() {
    ivec2 texel = ivec2(gl_GlobalInvocationID.xy);
    if (!is_gathered(texel)) return;
    Surface surface;
    bool is_there = read_receiver(texel, surface);
    vec4 light = vec4(0.0);
    if (is_there)
        light = light_of_probes(
            surface.position_ws, surface.geometric_normal, surface.shading_normal);
    imageStore(indirect_diffuse, texel, light);
}
