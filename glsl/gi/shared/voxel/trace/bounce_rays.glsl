// voxel.bounce by rays: the light that reaches each side of each voxel, E/π = 1/n Σ L_i over
// cosine-distributed directions from its mean position, which voxel.light then reflects. A thread a
// side.
layout(local_size_x = 64) in;

#include "gi/shared/voxel/records.glsl"

layout(std430, set = 1, binding = 0) restrict readonly buffer GatheringVoxels {
    Voxel gathering_voxels[];
};
// a side: E/π, half floats
layout(std430, set = 1, binding = 1) restrict buffer VoxelIrradiance { uvec2 voxel_irradiance[]; };

#include "gi/shared/voxel/trace/bounce_params.glsl"
#include "shared/environment.glsl"
#include "gi/shared/voxel/light/bounce.glsl"
#include "gi/shared/voxel/trace/trace.glsl"

void main() {
    uint index = gl_GlobalInvocationID.x + gl_GlobalInvocationID.y * 4194240u;
    if (index >= sides_of_voxels() * params.voxel_count) return;
    Voxel voxel = gathering_voxels[index / sides_of_voxels()];
    vec3 cell = params.first_voxel.xyz + voxel_coordinates(voxel.xy, voxel.z_area);
    vec3 receiver = params.voxel_scale * (cell + unpack_unorm10(voxel.mean_position));
    vec2 pattern = voxel_pattern(uvec3(cell));
    TraceSettings settings = TraceSettings(params.resolution, params.self_height,
        params.contour_slack, seed_of(uvec3(cell), index % sides_of_voxels()), 0u);
    float start_offset = params.voxel_scale * params.start_offset;
    uvec2 before = voxel_irradiance[index];
    vec3 sum = params.first_ray == 0u ? vec3(0.0)
                                      : vec3(unpackHalf2x16(before.x), unpackHalf2x16(before.y).x);
    for (uint i = params.first_ray; i < params.end_ray; ++i) {
        vec3 normal = looking_normal(voxel, sides_of_voxels(), index % sides_of_voxels(), i);
        float u = (float(i) + pattern.x) / float(params.ray_count);
        vec3 direction = hemisphere_direction(
            frame_around(normal), u, float(i) * GOLDEN_ANGLE + pattern.y * 2.0 * PI);
        settings.ray = i;
        float distance;
        int slot = trace(receiver + start_offset * normal, direction, receiver, normal, settings,
            distance);
        vec3 radiance;
        if (slot < 0) {
            radiance = environment_of_scattered(
                direction, dot(direction, normal) / PI, uint(params.ray_count));
        } else {
            radiance = radiance_along(uint(slot), direction);
        }
        sum += radiance / float(params.ray_count);
    }
    voxel_irradiance[index] = uvec2(packHalf2x16(sum.rg), packHalf2x16(vec2(sum.b, 0.0)));
}
