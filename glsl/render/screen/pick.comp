#version 460
#extension GL_GOOGLE_include_directive : require
// screen.pick: the surfaces of those pixels that light is gathered for.
layout(local_size_x = 8, local_size_y = 8) in;

layout(set = 1, binding = 0) uniform texture2D view_depth;
layout(set = 1, binding = 1) uniform utexture2D normals;
layout(set = 1, binding = 2, r32f) uniform restrict writeonly image2D picked_depth;
layout(set = 1, binding = 3, rgba32ui) uniform restrict writeonly uimage2D picked_normals;

#include "shared/gathered.glsl"

void main() {
    ivec2 texel = ivec2(gl_GlobalInvocationID.xy);
    if (!is_gathered(texel)) return;
    ivec2 pixel = pixel_of(place_of(texel));
    float depth_m = 0.0;
    uvec2 packed = uvec2(0u);
    if (all(lessThan(pixel, ivec2(frame.size_px.xy)))) {
        depth_m = texelFetch(sampler2D(view_depth, nearest_clamp), pixel, 0).r;
        packed = texelFetch(usampler2D(normals, nearest_clamp), pixel, 0).rg;
    }
    imageStore(picked_depth, texel, vec4(depth_m));
    imageStore(picked_normals, texel, uvec4(packed, 0u, 0u));
}
