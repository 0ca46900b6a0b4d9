#version 460
#extension GL_GOOGLE_include_directive : require
// gi.deinterleave: the mean of the n×n neighbours that lie on the pixel's own surface. Any n×n window holds each of the n² sampling patterns once,
// so that on a plane every pixel has the directions of all patterns (interleaved sampling, Keller & Heidrich 2001; Hong 2015, section 3).
layout(local_size_x = 8, local_size_y = 8) in;

layout(set = 1, binding = 0) uniform texture2D view_depth;
layout(set = 1, binding = 1) uniform utexture2D normals;
layout(set = 1, binding = 2) uniform texture2D interleaved;
layout(set = 1, binding = 3, rgba32f) uniform restrict writeonly image2D indirect_diffuse;

layout(push_constant) uniform DeinterleaveParams { uint interleave; } params;

#include "shared/gbuffer.glsl"

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy), size = ivec2(frame.size_px.xy);
    if (any(greaterThanEqual(pixel, size))) return;
    Surface surface;
    vec4 sum = vec4(0.0);
    if (read_surface(pixel, surface)) {
        float footprint = length(surface.position_ws - frame.eye_ws.xyz) * 2.0 * length(frame.ray_up.xyz) / float(size.y);
        int n = int(params.interleave);
        float count = 0.0;
        for (int i = 0; i < n * n; ++i) {
            ivec2 at = pixel + ivec2(i % n, i / n) - n / 2;
            Surface other;
            if (any(lessThan(at, ivec2(0))) || any(greaterThanEqual(at, size)) || !read_surface(at, other)) continue;
            float off_plane = abs(dot(other.position_ws - surface.position_ws, surface.geometric_normal));
            if (off_plane > 0.5 * footprint || dot(other.shading_normal, surface.shading_normal) < 0.9) continue;
            sum += texelFetch(sampler2D(interleaved, nearest_clamp), at, 0);
            count += 1.0;
        }
        sum /= max(count, 1.0);
    }
    imageStore(indirect_diffuse, pixel, sum);
}
