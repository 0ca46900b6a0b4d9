// cone.specular: indirect specular radiance L_s by one cone along the mirror direction. Its half
// angle is that within which a quarter of the GGX half-vectors fall, doubled: tan θ_h = α √(u / (1
// − u)) with u = 1/4; the lobe's directional albedo scales it.
layout(local_size_x = 8, local_size_y = 8) in;

layout(set = 1, binding = 3) uniform texture2D view_depth;
layout(set = 1, binding = 4) uniform utexture2D normals;
layout(set = 1, binding = 5) uniform texture2D albedo;
layout(set = 1, binding = 6) uniform texture2D specular;
layout(set = 1, binding = 7, rgba32f) uniform restrict writeonly image2D indirect_specular;

// Instead of light, x is the number of samples.
layout(constant_id = 1) const bool COUNT_SAMPLES = false;

#include "gi/shared/cone/march_settings.glsl"

layout(push_constant) uniform SpecularParams {
    vec4 grid;             // xyz: smallest corner of the grid [m]; w: voxel size [m]
    MarchSettings march;
    uint face_stride;      // of the volume: from a face of what it stores to the next
} params;

#include "shared/gbuffer.glsl"
#include "shared/ggx.glsl"
#include "gi/shared/cone/march.glsl"

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, ivec2(frame.size_px.xy)))) return;
    Surface surface;
    float roughness = texelFetch(sampler2D(albedo, nearest_clamp), pixel, 0).a;
    vec3 result = vec3(0.0);
    if (read_surface(pixel, surface) && roughness >= 0.0) {
        vec3 to_eye = normalize(frame.eye_ws.xyz - surface.position_ws);
        vec3 direction = reflect(-to_eye, surface.shading_normal);
        // A shading normal may reflect below the surface: lift the direction onto the horizon.
        float below = min(dot(direction, surface.geometric_normal) - 0.02, 0.0);
        direction = normalize(direction - below * surface.geometric_normal);
        float tan_half = tan(min(2.0 * atan(0.57735 * ggx_alpha(roughness)), 1.0));
        MarchSettings settings = params.march;
        vec3 receiver = (surface.position_ws - params.grid.xyz) / params.grid.w;
        float start_offset = settings.start_offset * largest_texel(receiver);
        vec3 origin = receiver + start_offset * surface.geometric_normal;
        float cosine = max(dot(direction, surface.geometric_normal), 0.0);
        vec3 f0 = texelFetch(sampler2D(specular, nearest_clamp), pixel, 0).rgb;
        ConeResult cone = march_cone(origin, direction, tan_half, start_offset, cosine, settings);
        vec3 albedo_ggx = ggx_albedo(f0, roughness, max(dot(surface.shading_normal, to_eye), 0.0));
        result = COUNT_SAMPLES ? vec3(cone.samples, 0.0, 0.0) : albedo_ggx * cone.radiance;
    }
    imageStore(indirect_specular, pixel, vec4(result, 0.0));
}
