#version 460
#extension GL_GOOGLE_include_directive : require
// The given value of each pixel that light is gathered for.
layout(local_size_x = 8, local_size_y = 8) in;

layout(set = 1, binding = 0) uniform texture2D view_depth;
layout(set = 1, binding = 1) uniform texture2D given;
layout(set = 1, binding = 2, rgba32f) uniform restrict writeonly image2D indirect_diffuse;

#include "shared/gathered.glsl"

void main() {
    ivec2 texel = ivec2(gl_GlobalInvocationID.xy);
    if (!is_gathered(texel)) return;
    float depth_m = texelFetch(sampler2D(view_depth, nearest_clamp), texel, 0).r;
    ivec2 pixel = pixel_of(place_of(texel));
    imageStore(indirect_diffuse, texel,
        depth_m > 0.0 ? texelFetch(sampler2D(given, nearest_clamp), pixel, 0) : vec4(0.0));
}
