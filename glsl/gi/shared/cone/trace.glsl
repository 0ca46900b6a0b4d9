// cone.trace: one cone, as the gathers trace them, with every sample that it takes: for looking at.
// One thread.
layout(local_size_x = 1) in;

#define VOLUME_BINDING 1

// Two rows of the cone: xyz its apex [voxels], w the number of samples; radiance [W/(m² sr)],
// visibility. Then two rows a sample: distance and diameter [voxels], level, opacity of the step;
// radiance premultiplied by opacity, opacity.
layout(std430, set = 1, binding = 0) restrict writeonly buffer TraceRows { vec4 trace_rows[]; };

#include "gi/shared/cone/march_settings.glsl"

layout(push_constant) uniform TraceParams {
    vec4 receiver;           // xyz: position [voxels]; w: tan(γ/2)
    vec4 normal;             // xyz: geometric normal
    vec4 direction;          // xyz: of the axis
    MarchSettings march;
    uint capacity;           // samples that there is room for
    uint face_stride;        // of the volume: from a face of what it stores to the next
} params;

void record_sample(vec3 position, float centre, float diameter, vec4 texel, float opacity);

#define RECORD_SAMPLES
#include "gi/shared/cone/march.glsl"

uint sample_count = 0u;

void record_sample(vec3 position, float centre, float diameter, vec4 texel, float opacity) {
    if (sample_count < params.capacity) {
        float level = sampled_level(position, params.march.resolution, diameter);
        trace_rows[2u + 2u * sample_count] = vec4(centre, diameter, level, opacity);
        trace_rows[3u + 2u * sample_count] = texel;
    }
    ++sample_count;
}

void main() {
    vec3 normal = params.normal.xyz, direction = params.direction.xyz;
    MarchSettings settings = params.march;
    float start_offset = settings.start_offset * largest_texel(params.receiver.xyz);
    vec3 origin = params.receiver.xyz + start_offset * normal;
    ConeResult result = march_cone(origin, direction, params.receiver.w, start_offset,
        max(dot(direction, normal), 0.0), settings);
    trace_rows[0] = vec4(origin, float(sample_count));
    trace_rows[1] = vec4(result.radiance, result.visibility);
}
