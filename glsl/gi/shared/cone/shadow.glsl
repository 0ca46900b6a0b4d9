// cone.shadow: light reflected once, each light seen by a cone through the voxels. L = Σ (ρ/π +
// f_s) E (n·ω) V; alpha is 1 where there is a surface.
layout(local_size_x = 8, local_size_y = 8) in;

#define VOLUME_BINDING 5

layout(set = 1, binding = 0) uniform texture2D view_depth;
layout(set = 1, binding = 1) uniform utexture2D normals;
layout(set = 1, binding = 2) uniform texture2D albedo;
layout(set = 1, binding = 3) uniform texture2D specular;
layout(set = 1, binding = 4, rgba32f) uniform restrict image2D direct;

#include "gi/shared/cone/march_settings.glsl"

layout(push_constant) uniform ShadowConeParams {
    vec4 grid;             // xyz: smallest corner of the grid [m]; w: voxel size [m]
    MarchSettings march;
    float tan_half;       // tan(γ/2)
    uint is_glossy;
    uint first_light;     // of this dispatch, which adds to what those before it left
    uint end_light;
    uint face_stride;     // of the volume: from a face of what it stores to the next
} params;

#define GLOSSY params.is_glossy
#include "shared/direct.glsl"
#include "gi/shared/cone/march.glsl"

// Where the last sample of a cone may begin so that, with its half diameter of at least `least` /
// 2, it stays in front of what is `distance` away [voxels].
float shadow_end(float distance, float tan_half, float step_factor, float least) {
    float wide = distance * max(1.0 - step_factor * tan_half, 0.25) / (1.0 + tan_half);
    return min(wide, distance - 0.5 * least - 0.5 * step_factor * least);
}

// `origin` [voxels] is `height` above the plane of `normal`; `direction` is a unit vector.
float cone_visibility(vec3 origin, vec3 normal, float height, vec3 direction, float distance,
    float tan_half, MarchSettings m) {
    // No way through the grid is longer than its diagonal.
    float longest = 1.8 * m.resolution,
          least = least_diameter(origin + min(distance, longest) * direction);
    m.max_distance = min(shadow_end(distance, tan_half, m.step_factor, least), longest);
    m.ao_falloff = 0.0;
    return march_cone(origin, direction, tan_half, height, max(dot(direction, normal), 0.0), m)
        .visibility;
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, ivec2(frame.size_px.xy)))) return;
    Reflector reflector;
    if (!read_reflector(pixel, reflector)) {
        imageStore(direct, pixel, vec4(0.0));
        return;
    }
    MarchSettings settings = params.march;
    vec3 normal = reflector.surface.geometric_normal;
    vec3 receiver = (reflector.surface.position_ws - params.grid.xyz) / params.grid.w;
    float start_offset = settings.start_offset * largest_texel(receiver);
    vec3 origin = receiver + start_offset * normal;
    vec3 radiance = params.first_light == 0u ? vec3(0.0) : imageLoad(direct, pixel).rgb;
    for (uint i = params.first_light; i < params.end_light; ++i) {
        vec3 to_light;
        float cosine, distance = 1e9;
        vec3 reflected = reflected_light(lights[i], reflector, to_light, cosine);
        if (cosine <= 0.0) continue;
        if (lights[i].position_kind.w != LIGHT_DIRECTIONAL) {
            vec3 offset = (lights[i].position_kind.xyz - params.grid.xyz) / params.grid.w - origin;
            distance = length(offset);
            to_light = offset / max(distance, 1e-6);
        }
        radiance += reflected
            * (cosine
                * cone_visibility(
                    origin, normal, start_offset, to_light, distance, params.tan_half, settings));
    }
    imageStore(direct, pixel, vec4(radiance, 1.0));
}
