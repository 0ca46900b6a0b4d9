// cone.gather: indirect diffuse irradiance E = π Σ w_i L_i and ambient visibility of each pixel, by
// a set of cones over the hemisphere. cone.occlusion: the ambient visibility alone, by another set;
// what was gathered stays.
layout(local_size_x = 8, local_size_y = 8) in;

#define VOLUME_BINDING 4

layout(set = 1, binding = 0) uniform texture2D view_depth;
layout(set = 1, binding = 1) uniform utexture2D normals;
// sin²θ, φ [rad], tan(γ/2), weight; weights sum to 1
layout(std430, set = 1, binding = 2) readonly buffer Cones { vec4 cones[]; };
layout(set = 1, binding = 3, rgba32f) uniform restrict image2D indirect_diffuse;

// Instead of light, x is the number of samples.
layout(constant_id = 1) const bool COUNT_SAMPLES = false;

#include "gi/shared/cone/march_settings.glsl"

layout(push_constant) uniform ConeParams {
    vec4 grid;             // xyz: smallest corner of the grid [m]; w: voxel size [m]
    MarchSettings march;
    uint first_cone;      // of this dispatch, which adds to what those before it left
    uint end_cone;
    uint pattern;         // of a tile of pixels, each of which turns the set differently
    float jitter;         // width of a stratum of sin²θ; 0 where the set has fixed elevations
    uint is_occlusion;    // 1: visibility alone
    uint face_stride;     // of the volume: from a face of what it stores to the next
} params;

#include "shared/receiver.glsl"
#include "shared/directions.glsl"
#include "gi/shared/cone/march.glsl"

void main() {
    ivec2 texel = ivec2(gl_GlobalInvocationID.xy);
    if (!is_gathered(texel)) return;
    Surface surface;
    if (!read_receiver(texel, surface)) {
        imageStore(indirect_diffuse, texel, vec4(0.0));
        return;
    }
    MarchSettings settings = params.march;
    vec3 receiver = (surface.position_ws - params.grid.xyz) / params.grid.w;
    float start_offset = settings.start_offset * largest_texel(receiver);
    vec3 origin = receiver + start_offset * surface.geometric_normal;
    mat3 around = frame_around(surface.shading_normal);
    vec2 offset = interleaved_offset(place_of(texel), params.pattern, frame.walk.x);
    bool adds = params.first_cone > 0u;
    vec4 sum = adds || params.is_occlusion != 0u ? imageLoad(indirect_diffuse, texel) : vec4(0.0);
    if (!adds) sum.a = 0.0;
    for (uint i = params.first_cone; i < params.end_cone; ++i) {
        vec4 cone = cones[i];
        vec3 direction = hemisphere_direction(
            around, cone.x + (offset.x - 0.5) * params.jitter, cone.y + offset.y * 2.0 * PI);
        float cosine = max(dot(direction, surface.geometric_normal), 0.0);
        ConeResult result = march_cone(origin, direction, cone.z, start_offset, cosine, settings);
        vec3 irradiance = params.is_occlusion != 0u ? vec3(0.0) : PI * result.radiance;
        sum += COUNT_SAMPLES ? vec4(result.samples, 0.0, 0.0, 0.0)
                             : cone.w * vec4(irradiance, result.visibility);
    }
    imageStore(indirect_diffuse, texel, sum);
}
