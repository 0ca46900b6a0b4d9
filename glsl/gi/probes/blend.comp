#version 460
#extension GL_GOOGLE_include_directive : require
// probes.blend: the irradiance of each probe by direction, E(n) = π Σ L max(0, n·ω) / Σ max(0, n·ω)
// over its rays, and the share of it that meets nothing; and how its luminance changes with the
// place. A workgroup a probe; a thread has four texels at a time, so that it reads a ray once for
// all of them.
layout(local_size_x = 16) in;

layout(constant_id = 0) const uint IRRADIANCE_TEXELS = 8;
layout(constant_id = 1) const uint ADDS = 0;   // 1: to what `before` has, whose alpha stays
layout(constant_id = 2) const uint HAS_GRADIENTS = 0;

layout(set = 1, binding = 0) uniform texture2D ray_set;
layout(set = 1, binding = 1) uniform utexture2D ray_hits;
layout(set = 1, binding = 2) uniform texture2D ray_light;
layout(set = 1, binding = 3) uniform texture2D before;
layout(set = 1, binding = 4) uniform texture2D gradients_before;
layout(std430, set = 1, binding = 5) restrict readonly buffer ScalesBefore {
    float scales_before[];
};
layout(std430, set = 1, binding = 6) restrict buffer ProbeScales {
    float probe_scales[];
};
layout(set = 1, binding = 7, rgba16f) uniform restrict image2D probe_irradiance;
layout(set = 1, binding = 8, rgba16f) uniform restrict image2D probe_gradients;

#define LIST_BINDING 9
#include "gi/probes/list.glsl"
#include "gi/probes/blend_params.glsl"
#include "shared/frame.glsl"
#include "gi/probes/atlas.glsl"
#include "gi/probes/gradient.glsl"
#include "gi/probes/rays.glsl"

const uint MOST_TEXELS = 256u;

const uint THREADS = gl_WorkGroupSize.x, TEXELS = 4u, RAYS = 64u;

shared vec3 directions[RAYS];
shared vec4 brought[RAYS];
shared vec4 sources[RAYS];      // of gradients
shared vec4 results[MOST_TEXELS];
shared vec3 gradients[MOST_TEXELS];
shared float largest[THREADS];

void main() {
    uint index = gl_WorkGroupID.x + gl_WorkGroupID.y * 65535u;
    if (index >= params.probe_count) return;
    uvec2 row = probe_list[params.first_probe + index];
    uint thread = gl_LocalInvocationID.x, probe = row.x;
    uint edge = IRRADIANCE_TEXELS, texel_count = edge * edge;
    mat3 turn = turn_of(row.y);
    ivec2 map = map_of(probe, params.columns, edge);
    float most = 0.0;
    for (uint first = 0u; first < texel_count; first += TEXELS * THREADS) {
        vec3 normals[TEXELS], changes[TEXELS];
        vec4 sums[TEXELS];
        float weights[TEXELS];
        for (uint i = 0u; i < TEXELS; ++i) {
            uint texel = first + i * THREADS + thread;
            normals[i] = direction_of_texel(vec2(texel % edge, texel / edge), edge);
            sums[i] = vec4(0.0);
            changes[i] = vec3(0.0);
            weights[i] = 0.0;
        }
        for (uint begin = 0u; begin < params.ray_count; begin += RAYS) {
            uint end = min(RAYS, params.ray_count - begin);
            barrier();
            for (uint i = thread; i < end; i += THREADS) {
                directions[i] = turn * ray_of_set(begin + i);
                ivec2 place = texel_of_ray(index * params.ray_count + begin + i);
                brought[i] = texelFetch(sampler2D(ray_light, nearest_clamp), place, 0);
                if (HAS_GRADIENTS != 0u) {
                    ivec2 met = texel_of_ray(probe * params.ray_count + begin + i);
                    uvec4 hit = texelFetch(usampler2D(ray_hits, nearest_clamp), met, 0);
                    sources[i] = gradient_source(hit, directions[i], brought[i].rgb);
                }
            }
            barrier();
            for (uint ray = 0u; ray < end; ++ray) {
                vec3 direction = directions[ray];
                vec4 light = brought[ray];
                for (uint i = 0u; i < TEXELS; ++i) {
                    float cosine = max(dot(normals[i], direction), 0.0);
                    sums[i] += cosine * light;
                    weights[i] += cosine;
                    if (HAS_GRADIENTS != 0u)
                        changes[i] += gradient_of(sources[ray], direction, normals[i], cosine);
                }
            }
        }
        for (uint i = 0u; i < TEXELS; ++i) {
            uint texel = first + i * THREADS + thread;
            if (texel >= texel_count) continue;
            vec4 light = sums[i] / max(weights[i], 1e-30) * vec4(vec3(PI), 1.0);
            vec3 gradient = changes[i] * (4.0 * PI / float(params.ray_count));
            if (ADDS != 0u) {
                ivec2 place = map + 1 + ivec2(texel % edge, texel / edge);
                vec4 first_light = texelFetch(sampler2D(before, nearest_clamp), place, 0);
                light = vec4(light.rgb + first_light.rgb * scales_before[probe], first_light.a);
                if (HAS_GRADIENTS != 0u)
                    gradient += scales_before[probe]
                        * texelFetch(sampler2D(gradients_before, nearest_clamp), place, 0).xyz;
            }
            if (params.kept > 0.0) {
                ivec2 place = map + 1 + ivec2(texel % edge, texel / edge);
                vec4 had = imageLoad(probe_irradiance, place);
                light = mix(light, vec4(had.rgb * probe_scales[probe], had.a), params.kept);
                if (HAS_GRADIENTS != 0u) {
                    vec3 had_change = imageLoad(probe_gradients, place).xyz;
                    gradient = mix(gradient, had_change * probe_scales[probe], params.kept);
                }
            }
            results[texel] = light;
            gradients[texel] = gradient;
            most = max(most, max(light.r, max(light.g, light.b)));
        }
    }
    largest[thread] = most;
    barrier();
    for (uint i = 0u; i < THREADS; ++i) most = max(most, largest[i]);
    float scale = scale_for(most);
    if (thread == 0u) probe_scales[probe] = scale;
    for (uint texel = thread; texel < texel_count; texel += THREADS) {
        ivec2 place = ivec2(texel % edge, texel / edge);
        vec4 stored = vec4(results[texel].rgb / scale, results[texel].a);
        vec4 gradient = vec4(clamp(gradients[texel] / scale, -LARGEST_HALF, LARGEST_HALF), 0.0);
        imageStore(probe_irradiance, map + 1 + place, stored);
        if (HAS_GRADIENTS != 0u) imageStore(probe_gradients, map + 1 + place, gradient);
        ivec2 copies[3] = border_of(place, int(edge));
        for (int i = 0; i < 3; ++i) {
            if (copies[i].x < 0) continue;
            imageStore(probe_irradiance, map + copies[i], stored);
            if (HAS_GRADIENTS != 0u) imageStore(probe_gradients, map + copies[i], gradient);
        }
    }
}
