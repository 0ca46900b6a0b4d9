#version 460
#extension GL_GOOGLE_include_directive : require
// screen.remember: of a few pixels, what they see and what they gathered, for the frame after.
layout(local_size_x = 8, local_size_y = 8) in;

layout(set = 1, binding = 0) uniform texture2D view_depth;
layout(set = 1, binding = 1) uniform utexture2D normals;
layout(set = 1, binding = 2) uniform texture2D motion;
layout(set = 1, binding = 3) uniform texture2D gathered;   // in the order of places
layout(set = 1, binding = 4, r32f) uniform restrict writeonly image2D kept_depth;
layout(set = 1, binding = 5, rgba32ui) uniform restrict writeonly uimage2D kept_normals;
layout(set = 1, binding = 6, rgba32f) uniform restrict writeonly image2D kept_light;

#include "shared/gathered.glsl"

void main() {
    ivec2 texel = ivec2(gl_GlobalInvocationID.xy);
    if (!is_gathered(texel)) return;
    ivec2 place = place_of(texel), pixel = pixel_of(place);
    float depth_m = 0.0;
    uvec2 packed = uvec2(0u);
    if (all(lessThan(pixel, ivec2(frame.size_px.xy)))) {
        depth_m = texelFetch(sampler2D(view_depth, nearest_clamp), pixel, 0).r;
        packed = texelFetch(usampler2D(normals, nearest_clamp), pixel, 0).rg;
        // What moves will be elsewhere.
        if (texelFetch(sampler2D(motion, nearest_clamp), pixel, 0).w > 0.0)
            depth_m = 0.0;
    }
    imageStore(kept_depth, texel, vec4(depth_m));
    imageStore(kept_normals, texel, uvec4(packed, 0u, 0u));
    imageStore(kept_light, texel, texelFetch(sampler2D(gathered, nearest_clamp), place, 0));
}
