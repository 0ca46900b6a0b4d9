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
#include "gi/shared/cone/light_cone.glsl"

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
        float cosine;
        vec3 reflected = reflected_light(lights[i], reflector, to_light, cosine);
        if (cosine <= 0.0) continue;
        float visibility = light_visibility(
            lights[i], origin, normal, start_offset, to_light, params.tan_half, settings);
        radiance += reflected * (cosine * visibility);
    }
    imageStore(direct, pixel, vec4(radiance, 1.0));
}
