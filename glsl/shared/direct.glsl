// What the surface of a pixel reflects of a light that nothing hides. The including pass declares
// the G-buffer with `albedo` and `specular`, and defines GLOSSY: whether the scene has specular
// lobes.
#ifndef LUMIVOX_DIRECT
#define LUMIVOX_DIRECT

#include "shared/light_view.glsl"
#include "shared/gbuffer.glsl"
#include "shared/ggx.glsl"

struct Reflector {
    Surface surface;
    vec3 to_eye;
    vec3 albedo; // times the length of the mean normal
    vec4 lobe;   // F0; roughness, negative where there is no lobe
};

// False where the pixel sees no surface.
bool read_reflector(ivec2 pixel, out Reflector r) {
    bool is_surface = read_surface(pixel, r.surface);
    r.to_eye = normalize(frame.eye_ws.xyz - r.surface.position_ws);
    vec4 base = texelFetch(sampler2D(albedo, nearest_clamp), pixel, 0);
    r.albedo = base.a * base.rgb;
    r.lobe = GLOSSY != 0u ? texelFetch(sampler2D(specular, nearest_clamp), pixel, 0)
                          : vec4(vec3(0.0), -1.0);
    return is_surface;
}

// (ρ/π + f_s) E, to be multiplied by n·ω, which is 0 where the light is behind the surface.
vec3 reflected_light(Light light, Reflector r, out vec3 to_light, out float cosine) {
    vec3 irradiance = light_irradiance(light, r.surface.position_ws, to_light);
    bool is_front = dot(r.surface.geometric_normal, to_light) > 0.0;
    cosine = is_front ? max(dot(r.surface.shading_normal, to_light), 0.0) : 0.0;
    if (cosine == 0.0) return vec3(0.0);
    vec3 reflected = r.albedo / PI;
    if (r.lobe.a >= 0.0)
        reflected += ggx_brdf(r.surface.shading_normal, r.to_eye, to_light, r.lobe.rgb, r.lobe.a);
    return reflected * irradiance;
}

#endif
