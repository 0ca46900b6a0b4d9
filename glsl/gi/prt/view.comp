#version 460
#extension GL_GOOGLE_include_directive : require
// prt.view: what was drawn of the points, as a view. A thread a pixel.
layout(local_size_x = 8, local_size_y = 8) in;

#include "shared/frame.glsl"

layout(set = 1, binding = 0) uniform texture2D drawn;
layout(set = 1, binding = 1, rgba32f) uniform restrict writeonly image2D seen;

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(seen)))) return;
    imageStore(seen, pixel, texelFetch(sampler2D(drawn, nearest_clamp), pixel, 0));
}
