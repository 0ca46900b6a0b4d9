#version 460
#extension GL_GOOGLE_include_directive : require
// test.field_rays: how rays end in the maps of a light field, and what they bring; and numbers that
// are packed and unpacked. A thread a ray.
layout(local_size_x = 64) in;

struct GivenRay {
    vec4 origin_probe;      // xyz: origin in the frame of the probe [cells]; w: the probe's bits
    vec4 direction_begin;   // xyz: direction; w: up to where the ray is free [cells]
};

struct RayEnd {
    vec4 light_at;   // rgb: radiance; w: how far along the ray [cells]
    vec4 origin;     // xyz: of the ray, packed and unpacked; w: bits of how it ends
};

layout(std430, set = 1, binding = 0) restrict readonly buffer FieldRays { GivenRay field_rays[]; };
layout(std430, set = 1, binding = 1) restrict writeonly buffer Ends { RayEnd ends[]; };

#include "gi/probes/lookup_row.glsl"

layout(push_constant) uniform FieldRayParams {
    LookupRow lookup;
    float thickness_m;
    uint count;
} params;

#include "shared/frame.glsl"
#define FIELD_BINDING 2
#define FIELD_CONSTANT 0
#include "gi/probes/light_field/march.glsl"

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= params.count) return;
    GivenRay given = field_rays[i];
    FieldRay ray = FieldRay(given.origin_probe.xyz, given.direction_begin.xyz);
    uint probe = floatBitsToUint(given.origin_probe.w);
    float t = given.direction_begin.w;
    uint met = march_probe(probe, ray, t);
    vec3 light = met == MET ? seen_of_field(probe, ray.origin + t * ray.direction).rgb : vec3(0.0);
    vec3 packed = unpack_rgbe(pack_rgbe(abs(ray.origin)));
    ends[i] = RayEnd(vec4(light, t), vec4(packed, uintBitsToFloat(met)));
}
