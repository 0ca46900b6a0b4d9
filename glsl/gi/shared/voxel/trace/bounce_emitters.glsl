// voxel.bounce_emitters: adds to what each side of each voxel gathers, E/π, the light of surfaces
// that emit, by rays from its mean position to points of them. A thread a side.
layout(local_size_x = 64) in;

#define PARTS_BINDING 0
#include "gi/shared/voxel/trace/emitters.glsl"
#include "gi/shared/voxel/trace/hides_point.glsl"

layout(std430, set = 1, binding = 1) restrict readonly buffer GatheringVoxels {
    Voxel gathering_voxels[];
};
// a side: E/π, half floats
layout(std430, set = 1, binding = 2) restrict buffer VoxelIrradiance { uvec2 voxel_irradiance[]; };

#include "gi/shared/voxel/trace/bounce_params.glsl"
#include "shared/frame.glsl"
#include "gi/shared/voxel/light/bounce.glsl"

// A voxel stands for a surface about as large as a face of it, so that nothing is nearer to it than
// this [voxels].
const float LEAST_DISTANCE = 0.25;

void main() {
    uint slot = gl_GlobalInvocationID.x + gl_GlobalInvocationID.y * 4194240u;
    uint sides = sides_of_voxels();
    if (slot >= sides * params.voxel_count) return;
    Voxel voxel = gathering_voxels[slot / sides];
    vec3 cell = params.first_voxel.xyz + voxel_coordinates(voxel.xy, voxel.z_area);
    vec3 receiver = params.voxel_scale * (cell + unpack_unorm10(voxel.mean_position));
    vec3 receiver_ws = params.grid.xyz + receiver * params.grid.w;
    float least = LEAST_DISTANCE * params.voxel_scale * params.grid.w;
    vec2 pattern = voxel_pattern(uvec3(cell));
    TraceSettings settings = TraceSettings(params.resolution, params.self_height,
        params.contour_slack, seed_of(uvec3(cell), slot % sides), 0u);
    vec3 sum = vec3(0.0);
    for (uint i = params.first_ray; i < params.end_ray; ++i) {
        vec3 normal = looking_normal(voxel, sides, slot % sides, i);
        EmitterPoint seen = ray_point(i, params.ray_count, pattern, params.part_count, receiver_ws,
            normal, normal, least * least);
        if (seen.irradiance == vec3(0.0)) continue;
        settings.ray = i;
        vec3 point = (seen.position - params.grid.xyz) / params.grid.w;
        if (!hides_point(receiver + params.voxel_scale * params.start_offset * normal, point,
                seen.normal, receiver,
                normal, settings))
            sum += seen.irradiance;
    }
    uvec2 before = voxel_irradiance[slot];
    vec3 gathered = vec3(unpackHalf2x16(before.x), unpackHalf2x16(before.y).x)
        + sum / (PI * float(params.ray_count));
    gathered = min(gathered, vec3(LARGEST_HALF));
    voxel_irradiance[slot] =
        uvec2(packHalf2x16(gathered.rg), packHalf2x16(vec2(gathered.b, 0.0)));
}
