#version 460
#extension GL_GOOGLE_include_directive : require
// render.composite: L = L_e + L_direct + ρ/π · E_i + L_s, the one pass that every technique's
// result goes through.
layout(local_size_x = 8, local_size_y = 8) in;

layout(constant_id = 0) const uint SPECULAR = 0;
layout(constant_id = 1) const uint EMISSIVE = 0;

layout(set = 1, binding = 0) uniform texture2D direct;
layout(set = 1, binding = 1) uniform texture2D albedo;
layout(set = 1, binding = 2) uniform texture2D indirect_diffuse;
layout(set = 1, binding = 3) uniform texture2D indirect_specular;
layout(set = 1, binding = 4) uniform texture2D emission;
layout(set = 1, binding = 5, rgba32f) uniform restrict writeonly image2D indirect;
layout(set = 1, binding = 6, rgba32f) uniform restrict writeonly image2D radiance;

#include "render/screen/seen.glsl"

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, ivec2(frame.size_px.xy)))) return;
    vec4 seen = texelFetch(sampler2D(direct, nearest_clamp), pixel, 0);
    vec3 reflected = vec3(0.0), emitted = vec3(0.0);
    if (seen.a > 0.0) {
        vec4 base = texelFetch(sampler2D(albedo, nearest_clamp), pixel, 0);
        vec3 irradiance = texelFetch(sampler2D(indirect_diffuse, nearest_clamp), pixel, 0).rgb;
        reflected = reflected_diffuse(base, irradiance);
        if (SPECULAR != 0u)
            reflected += texelFetch(sampler2D(indirect_specular, nearest_clamp), pixel, 0).rgb;
        emitted = EMISSIVE != 0u ? texelFetch(sampler2D(emission, nearest_clamp), pixel, 0).rgb
                                 : vec3(0.0);
    } else {
        emitted = environment_of_pixel(pixel);
    }
    imageStore(indirect, pixel, vec4(reflected, seen.a));
    imageStore(radiance, pixel, vec4(emitted + seen.rgb + reflected, seen.a));
}
