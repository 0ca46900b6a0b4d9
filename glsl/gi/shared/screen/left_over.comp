#version 460
#extension GL_GOOGLE_include_directive : require
// screen.left_over: the view depth of pixels whose surface none of the pixels beside them that
// gather shows; 0 elsewhere.
layout(local_size_x = 8, local_size_y = 8) in;

layout(set = 1, binding = 0) uniform texture2D view_depth;
layout(set = 1, binding = 1) uniform utexture2D normals;
layout(set = 1, binding = 2, r32f) uniform restrict writeonly image2D left_depth;

layout(push_constant) uniform CoarseParams {
    uvec2 size;              // of the coarse picture [texels]
    uint scale;              // width of a square of pixels that has one of its texels [px]
    float plane_tolerance;   // [footprints]
    float normal_cosine;
} params;

#include "gi/shared/screen/coarse.glsl"

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy), corner;
    if (any(greaterThanEqual(pixel, ivec2(frame.size_px.xy)))) return;
    Surface surface;
    float left_m = 0.0;
    if (read_surface(pixel, surface)
        && dot(coarse_weights(pixel, surface, corner), vec4(1.0)) < LEAST_SHOWN)
        left_m = texelFetch(sampler2D(view_depth, nearest_clamp), pixel, 0).r;
    imageStore(left_depth, pixel, vec4(left_m));
}
