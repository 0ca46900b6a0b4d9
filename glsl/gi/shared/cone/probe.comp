#version 460
#extension GL_GOOGLE_include_directive : require
// cone.probe: one cone, as the gathers trace them, with every sample that it takes: for looking at.
// One thread.
layout(local_size_x = 1) in;

// Two rows of the cone: xyz its apex [voxels], w the number of samples; radiance [W/(m² sr)],
// visibility. Then two rows a sample: distance and diameter [voxels], level, opacity of the step;
// radiance premultiplied by opacity, opacity.
layout(std430, set = 1, binding = 0) restrict writeonly buffer ProbeRows { vec4 probe_rows[]; };
#if defined(SVO)
layout(std430, set = 1, binding = 1) restrict readonly buffer Nodes { uint nodes[]; };
layout(set = 1, binding = 2) uniform texture3D bricks;
layout(set = 1, binding = 3) uniform texture3D normals_of_bricks;
#elif defined(CLIPMAP)
layout(std430, set = 1, binding = 1) restrict readonly buffer Levels { vec4 levels[]; };
layout(set = 1, binding = 2) uniform texture3D clipmap;
layout(set = 1, binding = 3) uniform texture3D top;
#else
layout(set = 1, binding = 1) uniform texture3D voxels;
layout(set = 1, binding = 2) uniform utexture3D matter;
layout(set = 1, binding = 3) uniform texture3D faces;
#endif

layout(push_constant) uniform ProbeParams {
    // xyz: position [voxels]; w: start of the cone along the normal [texels read there]
    vec4 receiver;
    vec4 normal;             // xyz: geometric normal; w: tan(γ/2)
    vec4 direction;          // xyz: of the axis; w: voxel size [m]
    float resolution;
    float step_factor;
    float opacity_exponent;
    float height_clamp;
    float max_distance;
    float ao_falloff;
    uint capacity;           // samples that there is room for
    uint face_stride;        // bricks of a sparse volume from a face of a tile to the next
} params;

void record_sample(vec3 position, float centre, float diameter, vec4 texel, float opacity);

#define PROBE
#include "gi/shared/cone/march.glsl"

uint sample_count = 0u;

// The level that a sample of this diameter is taken on.
float sampled_level(vec3 position, float diameter) {
    float level = log2(diameter);
#if defined(SVO)
    return clamp(level, 0.0, log2(params.resolution) - 1.0);
#elif defined(CLIPMAP)
    level = clamp(level, 0.0, float(LEVELS - 1 + findMSB(uint(N) / 8u)));
    return max(level, level_at(position, min(int(level), LEVELS - 1)));
#else
    return clamp(level, 0.0, log2(params.resolution));
#endif
}

void record_sample(vec3 position, float centre, float diameter, vec4 texel, float opacity) {
    if (sample_count < params.capacity) {
        probe_rows[2u + 2u * sample_count] =
            vec4(centre, diameter, sampled_level(position, diameter), opacity);
        probe_rows[3u + 2u * sample_count] = texel;
    }
    ++sample_count;
}

void main() {
    vec3 normal = params.normal.xyz, direction = params.direction.xyz;
    MarchSettings settings =
        MarchSettings(params.resolution, params.step_factor, params.opacity_exponent,
            params.height_clamp, params.max_distance, params.direction.w, params.ao_falloff);
    float start_offset = params.receiver.w * largest_texel(params.receiver.xyz);
    vec3 origin = params.receiver.xyz + start_offset * normal;
    ConeResult result = march_cone(origin, direction, params.normal.w, start_offset,
        max(dot(direction, normal), 0.0), settings);
    probe_rows[0] = vec4(origin, float(sample_count));
    probe_rows[1] = vec4(result.radiance, result.visibility);
}
