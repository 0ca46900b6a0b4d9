#version 460
#extension GL_GOOGLE_include_directive : require
// prt.gather: what prt.points has drawn, for the surfaces that are asked for.
layout(local_size_x = 8, local_size_y = 8) in;

layout(set = 1, binding = 0) uniform texture2D seen;
layout(set = 1, binding = 1) uniform texture2D view_depth;
layout(set = 1, binding = 2, rgba32f) uniform restrict writeonly image2D indirect_diffuse;

#include "shared/gathered.glsl"

void main() {
    ivec2 texel = ivec2(gl_GlobalInvocationID.xy);
    if (!is_gathered(texel)) return;
    bool is_surface = texelFetch(sampler2D(view_depth, nearest_clamp), texel, 0).r > 0.0;
    vec4 found = texelFetch(sampler2D(seen, nearest_clamp), pixel_of(place_of(texel)), 0);
    imageStore(indirect_diffuse, texel, is_surface ? found : vec4(0.0));
}
