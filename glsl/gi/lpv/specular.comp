#version 460
#extension GL_GOOGLE_include_directive : require
// lpv.specular: radiance along the mirror direction, over a lobe that is as wide as the surface is
// rough; a Gaussian on the sphere damps band l by exp(−l(l + 1) α² / 2).
layout(local_size_x = 8, local_size_y = 8) in;

layout(set = 1, binding = 0) uniform texture3D light;
layout(set = 1, binding = 1) uniform texture3D light_band2;
layout(set = 1, binding = 2) uniform texture2D view_depth;
layout(set = 1, binding = 3) uniform utexture2D normals;
layout(set = 1, binding = 4) uniform texture2D specular;
layout(set = 1, binding = 5, rgba32f) uniform restrict writeonly image2D indirect_specular;

#include "shared/gbuffer.glsl"
#include "shared/ggx.glsl"
#include "gi/lpv/lookup.glsl"

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, ivec2(frame.size_px.xy)))) return;
    Surface surface;
    vec4 lobe = texelFetch(sampler2D(specular, nearest_clamp), pixel, 0);
    vec3 result = vec3(0.0);
    if (read_surface(pixel, surface) && lobe.a >= 0.0) {
        vec3 to_eye = normalize(frame.eye_ws.xyz - surface.position_ws);
        vec4 coefficients[COEFFICIENTS];
        look_up(surface, coefficients);
        float alpha = ggx_alpha(lobe.a);
        float basis[COEFFICIENTS] = sh_evaluate3(reflect(-to_eye, surface.shading_normal));
        vec4 sum = vec4(0.0);
        for (int i = 0; i < COEFFICIENTS; ++i) {
            float band = float(band_of(i));
            sum += exp(-0.5 * band * (band + 1.0) * alpha * alpha) * basis[i] * coefficients[i];
        }
        sum = max(sum, vec4(0.0));
        float cosine = max(dot(surface.shading_normal, to_eye), 0.0);
        result = ggx_albedo(lobe.rgb, lobe.a, cosine) * (sum.rgb + sum.a * uniform_environment());
    }
    imageStore(indirect_specular, pixel, vec4(result, 0.0));
}
