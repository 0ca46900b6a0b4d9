#version 460
#extension GL_GOOGLE_include_directive : require
// render.direct: light reflected once. L = Σ (ρ/π + f_s) E (n·ω) V; alpha is 1 where there is a
// surface.
layout(local_size_x = 8, local_size_y = 8) in;

#include "shared/light_view.glsl"

layout(constant_id = 0) const uint GLOSSY = 0;
layout(constant_id = 1) const uint SHADOW_FILTER = 1;   // 0: point; 1: pcf; 2: pcss

layout(std430, set = 1, binding = 0) restrict readonly buffer LightViews {
    LightView light_views[];
};
layout(set = 1, binding = 1) uniform texture2DArray shadow_maps;
layout(set = 1, binding = 2) uniform texture2D view_depth;
layout(set = 1, binding = 3) uniform utexture2D normals;
layout(set = 1, binding = 4) uniform texture2D albedo;
layout(set = 1, binding = 5) uniform texture2D specular;
layout(set = 1, binding = 6, rgba32f) uniform restrict writeonly image2D direct;

layout(push_constant) uniform DirectParams { float sun_tangent; } params;

float sun_tangent() { return params.sun_tangent; }

#define SHADOW_FILTERS
#include "shared/visibility.glsl"
#include "shared/direct.glsl"

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, ivec2(frame.size_px.xy)))) return;
    Reflector reflector;
    if (!read_reflector(pixel, reflector)) {
        imageStore(direct, pixel, vec4(0.0));
        return;
    }
    vec3 radiance = vec3(0.0);
    for (uint i = 0u; i < frame.size_px.z; ++i) {
        vec3 to_light;
        float cosine;
        vec3 reflected = reflected_light(lights[i], reflector, to_light, cosine);
        if (cosine <= 0.0) continue;
        float lit = visibility_in(lights[i], lights[i].views.zw, reflector.surface.position_ws,
            reflector.surface.geometric_normal, 0.0, true);
        radiance += reflected * (cosine * lit);
    }
    imageStore(direct, pixel, vec4(radiance, 1.0));
}
