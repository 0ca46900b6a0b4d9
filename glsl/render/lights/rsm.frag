#version 460
#extension GL_GOOGLE_include_directive : require
// render.rsm: reflective shadow map (Dachsbacher & Stamminger 2005): geometric normal, and the
// reflected share of the light's intensity. With CASCADE, depth and normal are those of the
// triangle's plane (light_cascade.vert).
#include "shared/light_view.glsl"
#include "shared/material.glsl"
#include "shared/packing.glsl"

layout(location = 0) in vec3 position_ws;
layout(location = 1) in vec2 uv;
layout(location = 2) flat in uint material;

#ifdef CASCADE
#include "render/lights/cascade_depth.glsl"
layout(location = 6) flat in vec3 normal;
#else
layout(std430, set = 1, binding = 0) readonly buffer LightViews { LightView light_views[]; };

layout(push_constant) uniform ViewParams { uint view; } params;
#endif

layout(constant_id = 0) const bool MASKED = true;    // every material has a mask
layout(constant_id = 1) const bool TEXTURED = true;
layout(constant_id = 2) const bool SPOT = true;      // of a spot light

layout(location = 0) out uint rsm_normal;
layout(location = 1) out vec4 rsm_reflected;   // square roots of albedo × falloff

void main() {
    Material m = materials[material];
    bool is_cut = false;
    if (MASKED) is_cut = texture(sampler2D(mask_texture, linear_repeat), uv).r < 0.5;
    vec3 albedo = m.albedo.rgb * (1.0 - m.metalness.x);
    if (TEXTURED) albedo *= texture(sampler2D(albedo_texture, linear_repeat), uv).rgb;
    if (SPOT) {
        Light light = lights[light_views[params.view].light.x];
        albedo *= light_falloff(light, normalize(position_ws - light.position_kind.xyz));
    }
    if (CLEAR_SHADOWS)
        albedo *= clear_share(lights[light_views[params.view].light.x], position_ws);
#ifdef CASCADE
    rsm_normal = pack_unit(normal);
    gl_FragDepth = cascade_depth();
#else
    rsm_normal = pack_unit(normalize(cross(dFdx(position_ws), dFdy(position_ws))));
#endif
    rsm_reflected = vec4(sqrt(albedo), 1.0);
    // Last: differences to neighbours need them alive.
    if (is_cut) discard;
}
