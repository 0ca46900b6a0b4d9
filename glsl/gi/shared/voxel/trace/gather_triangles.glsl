// voxel.gather_triangles: indirect diffuse irradiance by rays against the scene's own triangles, E
// = π / n Σ L_i over cosine-distributed directions. What a ray hits has the radiance of the voxel
// there, on the side that is seen: what is visible is exact, and voxels are a cache of light.
layout(local_size_x = 8, local_size_y = 8) in;

#include "render/bvh/bindings.glsl"

layout(set = 1, binding = 5) uniform texture2D view_depth;
layout(set = 1, binding = 6) uniform utexture2D normals;
layout(set = 1, binding = 7, rgba32f) uniform restrict image2D indirect_diffuse;

#include "gi/shared/voxel/trace/ray_params.glsl"
#include "gi/shared/voxel/trace/pixel.glsl"
#include "gi/shared/voxel/trace/hit.glsl"
#include "render/bvh/start.glsl"
#include "render/bvh/traverse.glsl"

void main() {
    ivec2 texel = ivec2(gl_GlobalInvocationID.xy);
    PixelRays rays;
    if (!read_rays(texel, rays)) return;
    vec3 position = rays.surface.position_ws, normal = rays.surface.geometric_normal;
    vec3 origin = position + start_distance(position) * normal;
    vec3 radiance = vec3(0.0);
    float occlusion = 0.0;
    for (uint i = params.first_ray; i < params.end_ray; ++i) {
        vec3 direction = ray_direction(rays, i);
        if (dot(direction, normal) <= 0.0) continue;
        RayHit hit = closest_hit(origin, direction, NO_TRIANGLE);
        if (hit.triangle == NO_TRIANGLE) {
            radiance += environment_of(rays, direction);
        } else {
            uvec3 v = vertices_of(hit.triangle);
            vec3 a = position_of(v.x);
            vec3 facing = normalize(cross(position_of(v.y) - a, position_of(v.z) - a));
            if (dot(facing, direction) > 0.0) facing = -facing;
            vec3 met = (origin + hit.t * direction - params.grid.xyz) / params.grid.w;
            radiance += radiance_at(met, facing);
            occlusion += 1.0 / (1.0 + params.ao_falloff * hit.t);
        }
    }
    store_rays(texel, radiance, occlusion);
}
