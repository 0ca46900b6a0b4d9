#version 460
#extension GL_GOOGLE_include_directive : require
// lpv.gather: irradiance and ambient visibility by a lookup off the surface.
layout(local_size_x = 8, local_size_y = 8) in;

layout(set = 1, binding = 0) uniform texture3D light;
layout(set = 1, binding = 1) uniform texture3D light_band2;
layout(set = 1, binding = 2) uniform texture2D view_depth;
layout(set = 1, binding = 3) uniform utexture2D normals;
layout(set = 1, binding = 4, rgba32f) uniform restrict writeonly image2D indirect_diffuse;

#include "shared/receiver.glsl"
#include "gi/lpv/lookup.glsl"

void main() {
    ivec2 texel = ivec2(gl_GlobalInvocationID.xy);
    if (!is_gathered(texel)) return;
    Surface surface;
    vec4 result = vec4(0.0);
    if (read_receiver(texel, surface)) {
        vec4 coefficients[COEFFICIENTS];
        look_up(surface, coefficients);
        vec4 sum = irradiance(coefficients, surface.shading_normal);
        result = vec4(sum.rgb + sum.a * uniform_environment(), min(sum.a / PI, 1.0));
    }
    imageStore(indirect_diffuse, texel, result);
}
