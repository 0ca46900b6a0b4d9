#version 460
#extension GL_GOOGLE_include_directive : require
// voxel.bounce_emitters: adds to what each side of each voxel gathers, E/π, the light of surfaces
// that emit, by rays from its mean position to points of them. A thread a side.
layout(local_size_x = 64) in;

layout(constant_id = 0) const uint SIDES = 1;   // 2: a radiance for each side of a voxel

#include "gi/shared/voxel/trace/emitters.glsl"

// a side: E/π, half floats
layout(std430, set = 1, binding = 4) restrict buffer VoxelIrradiance { uvec2 voxel_irradiance[]; };

layout(push_constant) uniform BounceEmittersParams {
    vec4 grid;             // xyz: smallest corner of the grid [m]; w: voxel size [m]
    uint resolution;
    uint voxel_count;
    uint part_count;
    uint ray_count;        // of all dispatches
    uint first_ray;        // of this dispatch, which adds to what those before it left
    uint end_ray;
    float start_offset;    // [voxels]
    float self_height;     // [voxels]
    float contour_slack;   // [voxels]
} params;

#include "shared/frame.glsl"
#include "gi/shared/voxel/light/bounce.glsl"

// A voxel stands for a surface about as large as a face of it, so that nothing is nearer to it than
// this [voxels].
const float LEAST_DISTANCE = 0.25;

const float LARGEST_HALF = 65504.0;

void main() {
    uint slot = gl_GlobalInvocationID.x + gl_GlobalInvocationID.y * 4194240u;
    if (slot >= SIDES * params.voxel_count) return;
    Voxel voxel = voxel_records[slot / SIDES];
    vec3 cell = voxel_coordinates(voxel.xy, voxel.z_area);
    vec3 receiver = cell + unpack_unorm10(voxel.mean_position);
    vec3 receiver_ws = params.grid.xyz + receiver * params.grid.w;
    float least = LEAST_DISTANCE * params.grid.w;
    vec2 pattern = voxel_pattern(uvec3(cell));
    TraceSettings settings =
        TraceSettings(params.resolution, params.self_height, params.contour_slack);
    vec3 sum = vec3(0.0);
    for (uint i = params.first_ray; i < params.end_ray; ++i) {
        vec3 normal = looking_normal(voxel, SIDES, slot % SIDES, i);
        EmitterPoint seen = ray_point(i, params.ray_count, pattern, params.part_count, receiver_ws,
            normal, normal, least * least);
        if (seen.irradiance == vec3(0.0)) continue;
        vec3 point = (seen.position - params.grid.xyz) / params.grid.w;
        if (!hides_point(receiver + params.start_offset * normal, point, seen.normal, receiver,
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
