#version 460
#extension GL_GOOGLE_include_directive : require
// clear.cover: puts what is clear in front of the picture. All light of a pixel behind something
// clear is L_s, and the other terms are 0 there.
layout(local_size_x = 8, local_size_y = 8) in;

layout(constant_id = 0) const bool SPECULAR = false;
layout(constant_id = 1) const bool EMISSIVE = false;

layout(set = 1, binding = 0) uniform texture2D clear_filter;
layout(set = 1, binding = 1) uniform texture2D clear_light;
layout(set = 1, binding = 2) uniform texture2D albedo;
layout(set = 1, binding = 3) uniform texture2D indirect_diffuse;
layout(set = 1, binding = 4) uniform texture2D indirect_specular;
layout(set = 1, binding = 5, rgba32f) uniform restrict image2D direct;
layout(set = 1, binding = 6, rgba32f) uniform restrict image2D emission;
layout(set = 1, binding = 7, rgba32f) uniform restrict writeonly image2D covered_diffuse;
layout(set = 1, binding = 8, rgba32f) uniform restrict writeonly image2D covered_specular;

#include "render/screen/seen.glsl"

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, ivec2(frame.size_px.xy)))) return;
    vec4 left = texelFetch(sampler2D(clear_filter, nearest_clamp), pixel, 0);
    vec4 diffuse = texelFetch(sampler2D(indirect_diffuse, nearest_clamp), pixel, 0);
    vec3 mirrored = vec3(0.0);
    if (SPECULAR) mirrored = texelFetch(sampler2D(indirect_specular, nearest_clamp), pixel, 0).rgb;
    if (left.a == 0.0) {
        imageStore(covered_diffuse, pixel, diffuse);
        imageStore(covered_specular, pixel, vec4(mirrored, 0.0));
        return;
    }
    vec4 straight = imageLoad(direct, pixel);
    vec3 behind = environment_of_pixel(pixel);
    if (straight.a > 0.0) {
        vec4 base = texelFetch(sampler2D(albedo, nearest_clamp), pixel, 0);
        behind = straight.rgb + reflected_diffuse(base, diffuse.rgb) + mirrored;
        if (EMISSIVE) behind += imageLoad(emission, pixel).rgb;
    }
    vec3 through = texelFetch(sampler2D(clear_light, nearest_clamp), pixel, 0).rgb;
    imageStore(covered_diffuse, pixel, vec4(vec3(0.0), diffuse.a));
    imageStore(covered_specular, pixel, vec4(left.rgb * behind + through, 0.0));
    // The pixel has a surface now, whatever is behind.
    imageStore(direct, pixel, vec4(vec3(0.0), 1.0));
    if (EMISSIVE) imageStore(emission, pixel, vec4(0.0));
}
