#version 460
#extension GL_GOOGLE_include_directive : require
// voxel.bounce by rays: the light that reaches each side of each voxel, E/π = 1/n Σ L_i over
// cosine-distributed directions from its mean position, which voxel.light then reflects. A thread a
// side.
layout(local_size_x = 64) in;

layout(constant_id = 0) const uint SIDES = 1;   // 2: a radiance for each side of a voxel

layout(std430, set = 1, binding = 0) restrict readonly buffer Occupancy { uvec2 occupancy[]; };
layout(std430, set = 1, binding = 1) restrict readonly buffer BlockBases { uint block_bases[]; };

#include "gi/shared/voxel/records.glsl"

layout(std430, set = 1, binding = 2) restrict readonly buffer VoxelRecords {
    Voxel voxel_records[];
};
layout(std430, set = 1, binding = 3) restrict readonly buffer VoxelRadiance {
    uvec2 voxel_radiance[];
};
// a side: E/π, half floats
layout(std430, set = 1, binding = 4) restrict buffer VoxelIrradiance { uvec2 voxel_irradiance[]; };

layout(push_constant) uniform BounceRayParams {
    uint resolution;
    uint voxel_count;
    uint ray_count;        // of all dispatches
    uint first_ray;        // of this dispatch, which adds to what those before it left
    uint end_ray;
    float start_offset;    // [voxels]
    float self_height;     // [voxels]
    float contour_slack;   // [voxels]
} params;

#include "shared/frame.glsl"
#include "gi/shared/voxel/light/bounce.glsl"
#include "gi/shared/voxel/trace/trace.glsl"

void main() {
    uint slot = gl_GlobalInvocationID.x + gl_GlobalInvocationID.y * 4194240u;
    if (slot >= SIDES * params.voxel_count) return;
    Voxel voxel = voxel_records[slot / SIDES];
    vec3 cell = voxel_coordinates(voxel.xy, voxel.z_area);
    vec3 receiver = cell + unpack_unorm10(voxel.mean_position);
    vec2 pattern = voxel_pattern(uvec3(cell));
    TraceSettings settings =
        TraceSettings(params.resolution, params.self_height, params.contour_slack);
    uvec2 before = voxel_irradiance[slot];
    vec3 sum = params.first_ray == 0u ? vec3(0.0)
                                      : vec3(unpackHalf2x16(before.x), unpackHalf2x16(before.y).x);
    for (uint i = params.first_ray; i < params.end_ray; ++i) {
        vec3 normal = looking_normal(voxel, SIDES, slot % SIDES, i);
        float u = (float(i) + pattern.x) / float(params.ray_count);
        vec3 direction = hemisphere_direction(
            frame_around(normal), u, float(i) * GOLDEN_ANGLE + pattern.y * 2.0 * PI);
        float distance;
        int hit = trace(receiver + params.start_offset * normal, direction, receiver, normal,
            settings, distance);
        vec3 radiance = frame.environment.rgb;
        if (hit >= 0) {
            uint side = uint(hit);
            if (SIDES == 2u) side = 2u * side + uint(sees_back(voxel_records[hit], direction));
            uvec2 packed = voxel_radiance[side];
            radiance = vec3(unpackHalf2x16(packed.x), unpackHalf2x16(packed.y).x);
        }
        sum += radiance / float(params.ray_count);
    }
    voxel_irradiance[slot] = uvec2(packHalf2x16(sum.rg), packHalf2x16(vec2(sum.b, 0.0)));
}
