#version 460
#extension GL_GOOGLE_include_directive : require
// cascades.need: which probes of a level some triangle's places look up. A thread a triangle.
layout(local_size_x = 64) in;

// a bit a probe
layout(std430, set = 1, binding = 0) restrict buffer NeededProbes { uint needed_probes[]; };

layout(push_constant) uniform NeedParams {
    vec4 first;              // xyz: place of the level's first probe [m]; w: spacing [m]
    uvec4 counts;            // xyz: probes along each axis
    uint triangle_count;
    uint first_bit;          // of the level
    float reach;             // how far from a probe places look it up [spacings]
} params;

#include "shared/frame.glsl"

// Places are rounded by this much, as a share of coordinates.
const float ROUNDING = 1e-6;

void main() {
    uint triangle = gl_GlobalInvocationID.x + gl_WorkGroupID.y * (65535u * 64u);
    if (triangle >= params.triangle_count) return;
    uvec3 v = vertices_of(triangle);
    vec3 a = position_of(v.x), b = position_of(v.y), c = position_of(v.z);
    // In spacings, from the first probe.
    float scale = 1.0 / params.first.w;
    vec3 largest = max(max(abs(a), abs(b)), max(abs(c), abs(params.first.xyz)));
    float rounding = ROUNDING * max(largest.x, max(largest.y, largest.z)) * scale;
    float reach = params.reach + rounding;
    a = (a - params.first.xyz) * scale;
    b = (b - params.first.xyz) * scale;
    c = (c - params.first.xyz) * scale;
    vec3 last = vec3(params.counts.xyz) - 1.0;
    vec3 low = max(ceil(min(a, min(b, c)) - reach), vec3(0.0));
    vec3 high = min(floor(max(a, max(b, c)) + reach), last);
    if (any(greaterThan(low, high))) return;
    vec3 normal = cross(b - a, c - a);
    vec3 along = abs(normal);
    float radius = reach * (along.x + along.y + along.z);
    ivec3 begin = ivec3(low), end = ivec3(high);
    for (int z = begin.z; z <= end.z; ++z) {
        for (int y = begin.y; y <= end.y; ++y) {
            for (int x = begin.x; x <= end.x; ++x) {
                vec3 off = vec3(x, y, z) - a;
                if (abs(dot(normal, off)) > radius + rounding * length(normal)) continue;
                uvec3 at = uvec3(x, y, z);
                uint probe = at.x + params.counts.x * (at.y + params.counts.y * at.z);
                uint bit = params.first_bit + probe;
                atomicOr(needed_probes[bit / 32u], 1u << (bit % 32u));
            }
        }
    }
}
