// voxel.bounce by cones: the light that reaches each voxel, E/π = Σ w_i L_i over a set of cones
// from its mean position, which voxel.light then reflects. The same march as cone.gather's. A
// thread a side of a voxel; most have one radiance for all directions, and one side.
layout(local_size_x = 64) in;

#define VOLUME_BINDING 3

#include "gi/shared/voxel/records.glsl"

layout(std430, set = 1, binding = 0) restrict readonly buffer VoxelRecords {
    Voxel voxel_records[];
};
// sin²θ, φ [rad], tan(γ/2), weight; weights sum to 1
layout(std430, set = 1, binding = 1) readonly buffer Cones { vec4 cones[]; };
// a side: E/π, half floats
layout(std430, set = 1, binding = 2) restrict buffer VoxelIrradiance { uvec2 voxel_irradiance[]; };

#include "gi/shared/cone/march_settings.glsl"

layout(push_constant) uniform BounceConeParams {
    vec4 first_voxel;     // xyz: of the piece of the grid that the voxels are of [their size]
    MarchSettings march;
    uint voxel_count;
    uint first_cone;      // of this dispatch, which adds to what those before it left
    uint end_cone;
    float jitter;         // width of a stratum of sin²θ
    float voxel_scale;    // edge of the voxels that gather [voxels that are gathered from]
    uint face_stride;     // of the volume: from a face of what it stores to the next
} params;

#include "shared/frame.glsl"
#include "gi/shared/voxel/light/bounce.glsl"
#include "gi/shared/cone/march.glsl"

void main() {
    uint sides = sides_of_voxels();
    uint index = gl_GlobalInvocationID.x + gl_GlobalInvocationID.y * 4194240u;
    if (index >= sides * params.voxel_count) return;
    Voxel voxel = voxel_records[index / sides];
    vec3 cell = params.first_voxel.xyz + voxel_coordinates(voxel.xy, voxel.z_area);
    vec3 receiver = params.voxel_scale * (cell + unpack_unorm10(voxel.mean_position));
    vec2 pattern = voxel_pattern(uvec3(cell));
    MarchSettings settings = params.march;
    float start_offset = settings.start_offset * largest_texel(receiver);
    uvec2 before = voxel_irradiance[index];
    vec3 sum = params.first_cone == 0u ? vec3(0.0)
                                       : vec3(unpackHalf2x16(before.x), unpackHalf2x16(before.y).x);
    for (uint i = params.first_cone; i < params.end_cone; ++i) {
        vec4 cone = cones[i];
        vec3 normal = looking_normal(voxel, sides, index % sides, i);
        vec3 direction = hemisphere_direction(frame_around(normal),
            cone.x + (pattern.x - 0.5) * params.jitter, cone.y + pattern.y * 2.0 * PI);
        float cosine = max(dot(direction, normal), 0.0);
        sum += cone.w
            * march_cone(
                receiver + start_offset * normal, direction, cone.z, start_offset, cosine, settings)
                  .radiance;
    }
    voxel_irradiance[index] = uvec2(packHalf2x16(sum.rg), packHalf2x16(vec2(sum.b, 0.0)));
}
