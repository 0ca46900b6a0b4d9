#version 460
#extension GL_GOOGLE_include_directive : require
// screen.join: the parts of a split picture, put together again (Segovia et al. 2006).
layout(local_size_x = 8, local_size_y = 8) in;

layout(set = 1, binding = 0) uniform texture2D in_parts;
layout(set = 1, binding = 1, rgba32f) uniform restrict writeonly image2D joined;

layout(push_constant) uniform JoinParams {
    uvec2 size;              // of the picture in order [texels]
} params;

#include "shared/gathered.glsl"

void main() {
    ivec2 texel = ivec2(gl_GlobalInvocationID.xy);
    if (!is_gathered(texel)) return;
    ivec2 place = place_of(texel);
    if (any(greaterThanEqual(place, ivec2(params.size)))) return;
    imageStore(joined, place, texelFetch(sampler2D(in_parts, nearest_clamp), texel, 0));
}
