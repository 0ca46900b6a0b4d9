#version 460
#extension GL_GOOGLE_include_directive : require
// voxel.gather_rays: indirect diffuse irradiance by exact rays through the finest level, E = π / n
// Σ L_i over cosine-distributed directions: what the voxels themselves can give, without filtering.
layout(local_size_x = 8, local_size_y = 8) in;

layout(constant_id = 0) const uint SIDES = 1;   // 2: a radiance for each side of a voxel

layout(set = 1, binding = 0) uniform texture2D view_depth;
layout(set = 1, binding = 1) uniform utexture2D normals;
layout(std430, set = 1, binding = 2) restrict readonly buffer Occupancy { uvec2 occupancy[]; };
layout(std430, set = 1, binding = 3) restrict readonly buffer BlockBases { uint block_bases[]; };

#include "gi/shared/voxel/records.glsl"

layout(std430, set = 1, binding = 4) restrict readonly buffer VoxelRecords {
    Voxel voxel_records[];
};
layout(std430, set = 1, binding = 5) restrict readonly buffer VoxelRadiance {
    uvec2 voxel_radiance[];
};
layout(set = 1, binding = 6, rgba32f) uniform restrict image2D indirect_diffuse;

layout(push_constant) uniform RayParams {
    vec4 grid;             // xyz: smallest corner of the grid [m]; w: voxel size [m]
    uint resolution;
    uint ray_count;        // of all dispatches
    uint first_ray;        // of this dispatch, which adds to what those before it left
    uint end_ray;
    uint pattern;          // of a tile of pixels, each of which turns the rays differently
    float start_offset;    // [voxels]
    float self_height;     // [voxels]
    float contour_slack;   // [voxels]
    float ao_falloff;      // [1/m]
} params;

#include "shared/receiver.glsl"
#include "shared/directions.glsl"
#include "gi/shared/voxel/trace/trace.glsl"

const float GOLDEN_ANGLE = 2.399963229728653;

void main() {
    ivec2 texel = ivec2(gl_GlobalInvocationID.xy);
    if (!is_gathered(texel)) return;
    Surface surface;
    if (!read_receiver(texel, surface)) {
        imageStore(indirect_diffuse, texel, vec4(0.0));
        return;
    }
    TraceSettings settings =
        TraceSettings(params.resolution, params.self_height, params.contour_slack);
    vec3 receiver = (surface.position_ws - params.grid.xyz) / params.grid.w;
    vec3 origin = receiver + params.start_offset * surface.geometric_normal;
    mat3 around = frame_around(surface.shading_normal);
    vec2 offset = interleaved_offset(place_of(texel), params.pattern, frame.walk.x);
    vec3 radiance = vec3(0.0);
    float occlusion = 0.0;
    for (uint i = params.first_ray; i < params.end_ray; ++i) {
        float u = (float(i) + offset.x) / float(params.ray_count);
        vec3 direction =
            hemisphere_direction(around, u, float(i) * GOLDEN_ANGLE + offset.y * 2.0 * PI);
        if (dot(direction, surface.geometric_normal) <= 0.0) continue;
        float distance;
        int slot = trace(origin, direction, receiver, surface.geometric_normal, settings, distance);
        if (slot < 0) {
            radiance += frame.environment.rgb;
        } else {
            uint side = uint(slot);
            if (SIDES == 2u) side = 2u * side + uint(sees_back(voxel_records[slot], direction));
            uvec2 packed = voxel_radiance[side];
            radiance += vec3(unpackHalf2x16(packed.x), unpackHalf2x16(packed.y).x);
            occlusion += 1.0 / (1.0 + params.ao_falloff * distance * params.grid.w);
        }
    }
    vec4 before =
        params.first_ray == 0u ? vec4(0.0, 0.0, 0.0, 1.0) : imageLoad(indirect_diffuse, texel);
    imageStore(indirect_diffuse, texel,
        before + vec4(PI * radiance, -occlusion) / float(params.ray_count));
}
