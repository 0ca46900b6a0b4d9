// cone.specular: indirect specular radiance L_s by one cone along the mirror direction. Its half
// angle is that within which a quarter of the GGX half-vectors fall, doubled: tan θ_h = α √(u / (1
// − u)) with u = 1/4; the lobe's directional albedo scales it. Where the pixels of a tile have K
// directions between them, each mirrors about a half vector of its own, and u = 1/(4 K).
layout(local_size_x = 8, local_size_y = 8) in;

#define VOLUME_BINDING 4

layout(set = 1, binding = 0) uniform texture2D view_depth;
layout(set = 1, binding = 1) uniform utexture2D normals;
layout(set = 1, binding = 2) uniform texture2D specular;
layout(set = 1, binding = 3, rgba32f) uniform restrict writeonly image2D indirect_specular;

// Instead of light, x is the number of samples.
layout(constant_id = 1) const bool COUNT_SAMPLES = false;

#include "gi/shared/cone/march_settings.glsl"

layout(push_constant) uniform SpecularParams {
    vec4 grid;             // xyz: smallest corner of the grid [m]; w: voxel size [m]
    MarchSettings march;
    uint face_stride;      // of the volume: from a face of what it stores to the next
    uint pattern;          // of a tile of pixels, each of which mirrors about its own half vector
    float own_tan_half;    // of every cone; 0: by the lobe
    float falloff;         // q; 0: light does not depend on where the lights are
    float grace;           // p [rad]
    uint light_count;
} params;

#include "shared/light_view.glsl"
#include "shared/gbuffer.glsl"
#include "shared/ggx.glsl"
#include "shared/directions.glsl"
#include "gi/shared/cone/march.glsl"

// A cone of the lobe, and what of its light is reflected.
struct Mirrored {
    vec3 direction;
    float tan_half;
    vec3 reflected;
};

float tan_half_of(float alpha, float share) {
    if (params.own_tan_half > 0.0) return params.own_tan_half;
    return tan(min(2.0 * atan(alpha * sqrt(share / (1.0 - share))), 1.0));
}

Mirrored mirror(ivec2 pixel, vec3 n, vec3 to_eye, vec3 f0, float roughness) {
    float alpha = ggx_alpha(roughness);
    uint count = (params.pattern & 0xffu) * (params.pattern >> 8 & 0xffu);
    if (count == 1u) {
        vec3 albedo_ggx = ggx_albedo(f0, roughness, max(dot(n, to_eye), 0.0));
        return Mirrored(reflect(-to_eye, n), tan_half_of(alpha, 0.25), albedo_ggx);
    }
    mat3 around = frame_around(n);
    vec3 wo = to_eye * around;
    wo = normalize(vec3(wo.xy, max(wo.z, 1e-3)));
    vec2 uv = interleaved_offset(pixel, params.pattern, frame.walk.x);
    vec3 h = visible_half_vector(wo, alpha, uv), wi = reflect(-wo, h);
    vec3 reflected =
        wi.z > 0.0 ? schlick(f0, dot(wo, h)) * unmasked_share(wo, wi, alpha) : vec3(0.0);
    return Mirrored(around * wi, tan_half_of(alpha, 0.25 / float(count)), reflected);
}

// Σ (1 − max(0, γ − p)/π)^q over the lights, γ the angle between the cone and the way to each (Kahl
// 2019, equations 5.4 to 5.6).
float towards_lights(vec3 position_ws, vec3 direction) {
    float sum = 0.0;
    for (uint i = 0u; i < params.light_count; ++i) {
        vec3 to_light;
        light_irradiance(lights[i], position_ws, to_light);
        float beyond = max(acos(clamp(dot(direction, to_light), -1.0, 1.0)) - params.grace, 0.0);
        sum += pow(max(1.0 - beyond / PI, 0.0), params.falloff);
    }
    return sum;
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, ivec2(frame.size_px.xy)))) return;
    Surface surface;
    vec4 lobe = texelFetch(sampler2D(specular, nearest_clamp), pixel, 0);
    vec3 result = vec3(0.0);
    if (read_surface(pixel, surface) && lobe.a >= 0.0) {
        vec3 to_eye = normalize(frame.eye_ws.xyz - surface.position_ws);
        Mirrored mirrored = mirror(pixel, surface.shading_normal, to_eye, lobe.rgb, lobe.a);
        vec3 direction = mirrored.direction;
        // A shading normal may reflect below the surface: lift the direction onto the horizon.
        float below = min(dot(direction, surface.geometric_normal) - 0.02, 0.0);
        direction = normalize(direction - below * surface.geometric_normal);
        MarchSettings settings = params.march;
        vec3 receiver = (surface.position_ws - params.grid.xyz) / params.grid.w;
        float start_offset = settings.start_offset * largest_texel(receiver);
        vec3 origin = receiver + start_offset * surface.geometric_normal;
        float cosine = max(dot(direction, surface.geometric_normal), 0.0);
        ConeResult cone =
            march_cone(origin, direction, mirrored.tan_half, start_offset, cosine, settings);
        if (params.falloff > 0.0)
            mirrored.reflected *= towards_lights(surface.position_ws, direction);
        result =
            COUNT_SAMPLES ? vec3(cone.samples, 0.0, 0.0) : mirrored.reflected * cone.radiance;
    }
    imageStore(indirect_specular, pixel, vec4(result, 0.0));
}
