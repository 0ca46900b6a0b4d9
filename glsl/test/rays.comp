#version 460
#extension GL_GOOGLE_include_directive : require
// test.rays: what rays meet. A thread a ray.
layout(local_size_x = 64) in;

#include "render/bvh/traverse.glsl"

struct TestRay {
    vec4 origin_reach;       // xyz: origin [m]; w: longest distance
    vec4 direction_leaves;   // xyz: direction; w: bits of the triangle that it leaves
};

layout(std430, set = 1, binding = 5) restrict readonly buffer Rays { TestRay rays[]; };
layout(std430, set = 1, binding = 6) restrict writeonly buffer Hits { uvec4 hits[]; };

layout(push_constant) uniform Params {
    uint count;
    uint any;
} params;

void main() {
    uint i = gl_GlobalInvocationID.x + gl_GlobalInvocationID.y * 4194240u;
    if (i >= params.count) return;
    TestRay ray = rays[i];
    RayHit hit = traverse(ray.origin_reach.xyz, ray.direction_leaves.xyz, ray.origin_reach.w,
        floatBitsToUint(ray.direction_leaves.w), NO_TRIANGLE, params.any != 0u);
    hits[i] = uvec4(hit.triangle, floatBitsToUint(hit.t), floatBitsToUint(hit.at));
}
