// cone.patches: adds the light of patches of surface that emit to the diffuse irradiance, each seen
// by a cone through the voxels that is as wide as the patch. E = Σ L A cos θ cos θ' V / (d² + r²).
layout(local_size_x = 8, local_size_y = 8) in;

#define VOLUME_BINDING 4

struct GpuPatch {
    vec4 position_area;    // xyz: position [m]; w: area [m²]
    vec4 normal_radius;    // xyz: unit normal; w: radius [m]
    vec4 radiance;         // rgb: emitted radiance [W/(m² sr)]
};

layout(set = 1, binding = 0) uniform texture2D view_depth;
layout(set = 1, binding = 1) uniform utexture2D normals;
layout(std430, set = 1, binding = 2) restrict readonly buffer Patches { GpuPatch patches[]; };
layout(set = 1, binding = 3, rgba32f) uniform restrict image2D indirect_diffuse;

#include "gi/shared/cone/march_settings.glsl"

layout(push_constant) uniform PatchParams {
    vec4 grid;             // xyz: smallest corner of the grid [m]; w: voxel size [m]
    // Its start offset is that of the cones' end before the patch, too.
    MarchSettings march;
    uint first_patch;     // of this dispatch
    uint end_patch;
    uint face_stride;     // of the volume: from a face of what it stores to the next
} params;

#include "shared/gbuffer.glsl"
#define END_PLANE
#include "gi/shared/cone/march.glsl"

// Where the last step of a cone may begin so that its sample is no lower over the patch's plane
// than cones start, and, where no clamp keeps it narrow, no lower than it is wide [voxels].
// `cosine` is that of the patch.
float patch_end(float distance, float cosine, float tan_half, float least) {
    MarchSettings m = params.march;
    float narrow = distance - m.start_offset * least / cosine - 0.5 * m.step_factor * least;
    float wide = distance * cosine / (2.0 * tan_half + cosine)
        * max(1.0 - m.step_factor * tan_half, 0.25);
    return m.height_clamp > 0.0 ? narrow : min(wide, narrow);
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, ivec2(frame.size_px.xy)))) return;
    Surface surface;
    if (!read_surface(pixel, surface)) return;
    MarchSettings settings = params.march;
    vec3 normal = surface.geometric_normal;
    vec3 receiver = (surface.position_ws - params.grid.xyz) / params.grid.w;
    float start_offset = settings.start_offset * largest_texel(receiver);
    vec3 origin = receiver + start_offset * normal;
    vec3 irradiance = vec3(0.0);
    for (uint i = params.first_patch; i < params.end_patch; ++i) {
        GpuPatch seen = patches[i];
        vec3 offset = seen.position_area.xyz - surface.position_ws;
        float squared = dot(offset, offset);
        vec3 to_patch = offset * inversesqrt(max(squared, 1e-12));
        float cosine =
            dot(normal, to_patch) > 0.0 ? max(dot(surface.shading_normal, to_patch), 0.0) : 0.0;
        float radius = seen.normal_radius.w;
        float arriving = seen.position_area.w * cosine
            * max(-dot(seen.normal_radius.xyz, to_patch), 0.0)
            / max(squared + radius * radius, 1e-12);
        if (arriving <= 0.0) continue;
        vec3 way = (seen.position_area.xyz - params.grid.xyz) / params.grid.w - origin;
        float distance = length(way),
              leaving = -dot(seen.normal_radius.xyz, way) / max(distance, 1e-6);
        vec3 direction = way / max(distance, 1e-6);
        float visibility = 1.0;
        if (leaving > 1e-3) {
            float tan_half = min(radius / (params.grid.w * max(distance, 1e-6)), 1.0);
            float longest = 1.8 * settings.resolution,
                  least = least_diameter(origin + min(distance, longest) * direction);
            settings.max_distance = min(patch_end(distance, leaving, tan_half, least), longest);
            float rising = max(dot(direction, normal), 0.0);
            visibility = march_cone(origin, direction, tan_half, start_offset, rising, settings,
                distance * leaving, leaving)
                             .visibility;
        }
        irradiance += seen.radiance.rgb * (arriving * visibility);
    }
    vec4 before = imageLoad(indirect_diffuse, pixel);
    imageStore(indirect_diffuse, pixel, before + vec4(irradiance, 0.0));
}
