#version 460
#extension GL_GOOGLE_include_directive : require
// probes.blend_sh: the radiance that comes to each probe as spherical harmonics of three bands, and
// the share of directions that meets nothing: 4π/n Σ (L − L̄) Y(ω) over its rays, and their mean L̄
// itself, so that a uniform L is exact for any rays. A workgroup a probe; a coefficient is a texel
// of its 3×3.
layout(local_size_x = 64) in;

layout(constant_id = 0) const uint ADDS = 0;   // 1: to what `before` has, whose alpha stays

layout(set = 1, binding = 0) uniform texture2D ray_set;
layout(set = 1, binding = 1) uniform texture2D ray_light;
layout(set = 1, binding = 2) uniform texture2D before;
layout(std430, set = 1, binding = 3) restrict readonly buffer ScalesBefore {
    float scales_before[];
};
layout(std430, set = 1, binding = 4) restrict buffer ProbeScales {
    float probe_scales[];
};
layout(set = 1, binding = 5, rgba16f) uniform restrict image2D probe_irradiance;

#define LIST_BINDING 6
#include "gi/probes/list.glsl"
#include "gi/probes/blend_params.glsl"
#include "shared/frame.glsl"
#include "gi/probes/atlas.glsl"
#include "gi/probes/rays.glsl"
#include "gi/shared/sh.glsl"

const uint THREADS = gl_WorkGroupSize.x, COEFFICIENTS = 9u;

shared vec4 parts[THREADS * COEFFICIENTS];
shared float bases[THREADS * COEFFICIENTS];
shared vec4 results[COEFFICIENTS];

void main() {
    uint index = gl_WorkGroupID.x + gl_WorkGroupID.y * 65535u;
    if (index >= params.probe_count) return;
    uvec2 row = probe_list[params.first_probe + index];
    uint thread = gl_LocalInvocationID.x, probe = row.x;
    mat3 turn = turn_of(row.y);
    vec4 sums[COEFFICIENTS];
    float own[COEFFICIENTS];
    for (uint i = 0u; i < COEFFICIENTS; ++i) {
        sums[i] = vec4(0.0);
        own[i] = 0.0;
    }
    for (uint ray = thread; ray < params.ray_count; ray += THREADS) {
        float basis[9] = sh_evaluate3(turn * ray_of_set(ray));
        ivec2 place = texel_of_ray(index * params.ray_count + ray);
        vec4 light = texelFetch(sampler2D(ray_light, nearest_clamp), place, 0);
        for (uint i = 0u; i < COEFFICIENTS; ++i) {
            sums[i] += basis[i] * light;
            own[i] += basis[i];
        }
    }
    for (uint i = 0u; i < COEFFICIENTS; ++i) {
        parts[i * THREADS + thread] = sums[i];
        bases[i * THREADS + thread] = own[i];
    }
    barrier();
    ivec2 texel = map_of(probe, params.columns, 1u) + ivec2(thread % 3u, thread / 3u);
    if (thread < COEFFICIENTS) {
        vec4 sum = vec4(0.0), all = vec4(0.0);
        float base = 0.0;
        for (uint i = 0u; i < THREADS; ++i) {
            sum += parts[thread * THREADS + i];
            all += parts[i];
            base += bases[thread * THREADS + i];
        }
        if (thread > 0u) sum -= all * (base / (SH_Y0 * float(params.ray_count)));
        sum *= 4.0 * PI / float(params.ray_count);
        if (ADDS != 0u) {
            vec4 first = texelFetch(sampler2D(before, nearest_clamp), texel, 0);
            sum = vec4(sum.rgb + first.rgb * scales_before[probe], first.a);
        }
        if (params.kept > 0.0) {
            vec4 had = imageLoad(probe_irradiance, texel);
            sum = mix(sum, vec4(had.rgb * probe_scales[probe], had.a), params.kept);
        }
        results[thread] = sum;
    }
    barrier();
    float most = 0.0;
    for (uint i = 0u; i < COEFFICIENTS; ++i) {
        vec3 size = abs(results[i].rgb);
        most = max(most, max(size.r, max(size.g, size.b)));
    }
    float scale = scale_for(most);
    if (thread == 0u) probe_scales[probe] = scale;
    if (thread < COEFFICIENTS) {
        vec4 stored = vec4(results[thread].rgb / scale, results[thread].a);
        imageStore(probe_irradiance, texel, stored);
    }
}
