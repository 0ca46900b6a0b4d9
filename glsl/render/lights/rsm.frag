#version 460
#extension GL_GOOGLE_include_directive : require
// render.rsm: reflective shadow map (Dachsbacher & Stamminger 2005): geometric normal, and the
// reflected share of the light's intensity.
#include "shared/light_view.glsl"
#include "shared/material.glsl"
#include "shared/packing.glsl"

layout(std430, set = 1, binding = 0) readonly buffer LightViews { LightView light_views[]; };

layout(push_constant) uniform ViewParams { uint view; } params;

layout(location = 0) in vec3 position_ws;
layout(location = 1) in vec2 uv;
layout(location = 2) flat in uint material;

layout(location = 0) out uint rsm_normal;
layout(location = 1) out vec4 rsm_reflected;   // square roots of albedo × falloff

void main() {
    Material m = materials[material];
    if (m.albedo.w > 0.0 && texture(sampler2D(mask_texture, linear_repeat), uv).r < 0.5) discard;
    Light light = lights[light_views[params.view].light.x];
    vec3 albedo = m.albedo.rgb * (1.0 - m.metalness.x)
        * texture(sampler2D(albedo_texture, linear_repeat), uv).rgb;
    rsm_normal = pack_unit(normalize(cross(dFdx(position_ws), dFdy(position_ws))));
    rsm_reflected = vec4(
        sqrt(albedo * light_falloff(light, normalize(position_ws - light.position_kind.xyz))), 1.0);
}
