// voxel.gather_rays: indirect diffuse irradiance by exact rays through the voxels of a space, E = π
// / n Σ L_i over cosine-distributed directions: what the voxels themselves can give, without
// filtering.
layout(local_size_x = 8, local_size_y = 8) in;

layout(set = 1, binding = 0) uniform texture2D view_depth;
layout(set = 1, binding = 1) uniform utexture2D normals;
layout(set = 1, binding = 2, rgba32f) uniform restrict image2D indirect_diffuse;

#include "gi/shared/voxel/trace/ray_params.glsl"
#include "gi/shared/voxel/trace/pixel.glsl"
#include "gi/shared/voxel/trace/trace.glsl"

void main() {
    ivec2 texel = ivec2(gl_GlobalInvocationID.xy);
    PixelRays rays;
    if (!read_rays(texel, rays)) return;
    TraceSettings settings = TraceSettings(
        params.resolution, params.self_height, params.contour_slack, rays.seed, 0u);
    vec3 receiver = (rays.surface.position_ws - params.grid.xyz) / params.grid.w;
    vec3 normal = rays.surface.geometric_normal;
    vec3 origin = receiver + params.start_offset * voxel_edge(receiver) * normal;
    vec3 radiance = vec3(0.0);
    float occlusion = 0.0;
    for (uint i = params.first_ray; i < params.end_ray; ++i) {
        vec3 direction = ray_direction(rays, i);
        if (dot(direction, normal) <= 0.0) continue;
        settings.ray = i;
        float distance;
        int slot = trace(origin, direction, receiver, normal, settings, distance);
        if (slot < 0) {
            radiance += environment_of(rays, direction);
        } else {
            radiance += radiance_along(uint(slot), direction);
            occlusion += 1.0 / (1.0 + params.ao_falloff * distance * params.grid.w);
        }
    }
    store_rays(texel, radiance, occlusion);
}
