#version 460
#extension GL_GOOGLE_include_directive : require
// probes.blend: the irradiance of each probe by direction, E(n) = π Σ L max(0, n·ω) / Σ max(0, n·ω)
// over its rays, and the share of it that meets nothing; and how its luminance changes with the
// place. A workgroup a probe; a thread has some texels at a time, and reads a ray once for all of
// them.
//
// Every other texel looks the opposite way of one before it, where the edge is even. As
// max(0, −c) = max(0, c) − c, its sums are those of the first less what n·ω itself sums up to, and
// Σ ω L is one for all texels.
layout(local_size_x = 8) in;   // as many as a CPU's vectors have numbers

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
shared vec4 along[3u * THREADS];    // by axis: of the rays of each thread, Σ ω L
shared vec3 ways[THREADS];          // and Σ ω

// The texel that looks the opposite way, in the other half of the rows of an even edge.
uint opposite_of(uint texel, uint edge) {
    ivec2 size = ivec2(edge), place = ivec2(texel % edge, texel / edge);
    // From the middle, in halves of a texel.
    ivec2 at = 2 * place + 1 - size;
    ivec2 folded = (size - abs(at.yx)) * ivec2(at.x < 0 ? 1 : -1, at.y < 0 ? 1 : -1);
    ivec2 other = (folded + size - 1) / 2;
    return uint(other.x) + edge * uint(other.y);
}

void keep(uint texel, uint probe, ivec2 map, vec4 light, vec3 gradient) {
    ivec2 place = map + 1 + ivec2(texel % IRRADIANCE_TEXELS, texel / IRRADIANCE_TEXELS);
    if (ADDS != 0u) {
        vec4 first_light = texelFetch(sampler2D(before, nearest_clamp), place, 0);
        light = vec4(light.rgb + first_light.rgb * scales_before[probe], first_light.a);
        if (HAS_GRADIENTS != 0u)
            gradient += scales_before[probe]
                * texelFetch(sampler2D(gradients_before, nearest_clamp), place, 0).xyz;
    }
    if (params.kept > 0.0) {
        vec4 had = imageLoad(probe_irradiance, place);
        light = mix(light, vec4(had.rgb * probe_scales[probe], had.a), params.kept);
        if (HAS_GRADIENTS != 0u) {
            vec3 had_change = imageLoad(probe_gradients, place).xyz;
            gradient = mix(gradient, had_change * probe_scales[probe], params.kept);
        }
    }
    results[texel] = light;
    gradients[texel] = gradient;
}

// E(n), and the share that meets nothing.
vec4 irradiance_of(vec4 sum, float weight) {
    return max(sum, vec4(0.0)) / max(weight, 1e-30) * vec4(vec3(PI), 1.0);
}

void main() {
    uint index = gl_WorkGroupID.x + gl_WorkGroupID.y * 65535u;
    if (index >= params.probe_count) return;
    uvec2 row = probe_list[params.first_probe + index];
    uint thread = gl_LocalInvocationID.x, probe = row.x;
    uint edge = IRRADIANCE_TEXELS, texel_count = edge * edge;
    mat3 turn = turn_of(row.y);
    ivec2 map = map_of(probe, params.columns, edge);
    bool has_pairs = HAS_GRADIENTS == 0u && edge % 2u == 0u;
    uint summed = has_pairs ? texel_count / 2u : texel_count;
    mat3x4 own_along = mat3x4(0.0);
    vec3 own_ways = vec3(0.0);
    for (uint first = 0u; first < summed; first += TEXELS * THREADS) {
        vec3 normals[TEXELS], changes[TEXELS];
        // A component a texel; of the first two a column a coordinate and a channel.
        mat3x4 ways_to = mat3x4(0.0);
        mat4 sums = mat4(0.0);
        vec4 weights = vec4(0.0);
        for (uint i = 0u; i < TEXELS; ++i) {
            uint texel = first + i * THREADS + thread;
            normals[i] = direction_of_texel(vec2(texel % edge, texel / edge), edge);
            changes[i] = vec3(0.0);
            for (int axis = 0; axis < 3; ++axis) ways_to[axis][i] = normals[i][axis];
        }
        for (uint begin = 0u; begin < params.ray_count; begin += RAYS) {
            uint end = min(RAYS, params.ray_count - begin);
            barrier();
            // A ray that is not there brings nothing, and makes their number even.
            if (thread == 0u && end < RAYS) {
                directions[end] = vec3(0.0);
                brought[end] = vec4(0.0);
                sources[end] = vec4(0.0);
            }
            for (uint i = thread; i < end; i += THREADS) {
                vec3 direction = turn * ray_of_set(begin + i);
                ivec2 place = texel_of_ray(index * params.ray_count + begin + i);
                vec4 light = texelFetch(sampler2D(ray_light, nearest_clamp), place, 0);
                directions[i] = direction;
                brought[i] = light;
                if (first == 0u) {
                    own_along += outerProduct(light, direction);
                    own_ways += direction;
                }
                if (HAS_GRADIENTS != 0u) {
                    ivec2 met = texel_of_ray(probe * params.ray_count + begin + i);
                    uvec4 hit = texelFetch(usampler2D(ray_hits, nearest_clamp), met, 0);
                    sources[i] = gradient_source(hit, direction, light.rgb);
                }
            }
            barrier();
            // Two a turn: software devices end a thread's loops after some turns.
            for (uint ray = 0u; ray < end; ray += 2u) {
                mat2x4 cosines = mat2x4(max(ways_to * directions[ray], vec4(0.0)),
                    max(ways_to * directions[ray + 1u], vec4(0.0)));
                sums += outerProduct(cosines[0], brought[ray])
                    + outerProduct(cosines[1], brought[ray + 1u]);
                weights += cosines[0] + cosines[1];
                if (HAS_GRADIENTS != 0u)
                    for (uint i = 0u; i < TEXELS; ++i)
                        for (uint k = 0u; k < 2u; ++k)
                            changes[i] += gradient_of(sources[ray + k], directions[ray + k],
                                normals[i], cosines[k][i]);
            }
        }
        mat3x4 all_along = mat3x4(0.0);
        vec3 all_ways = vec3(0.0);
        if (has_pairs) {
            for (int axis = 0; axis < 3; ++axis)
                along[3u * thread + uint(axis)] = own_along[axis];
            ways[thread] = own_ways;
            barrier();
            for (uint i = 0u; i < THREADS; ++i) {
                for (int axis = 0; axis < 3; ++axis) all_along[axis] += along[3u * i + uint(axis)];
                all_ways += ways[i];
            }
        }
        for (uint i = 0u; i < TEXELS; ++i) {
            uint texel = first + i * THREADS + thread;
            if (texel >= summed) continue;
            vec3 gradient = changes[i] * (4.0 * PI / float(params.ray_count));
            vec4 sum = vec4(sums[0][i], sums[1][i], sums[2][i], sums[3][i]);
            keep(texel, probe, map, irradiance_of(sum, weights[i]), gradient);
            if (!has_pairs) continue;
            sum -= all_along * normals[i];
            float weight = weights[i] - dot(normals[i], all_ways);
            keep(opposite_of(texel, edge), probe, map, irradiance_of(sum, weight), vec3(0.0));
        }
    }
    barrier();
    float own_most = 0.0;
    for (uint texel = thread; texel < texel_count; texel += THREADS) {
        vec3 light = results[texel].rgb;
        own_most = max(own_most, max(light.r, max(light.g, light.b)));
    }
    largest[thread] = own_most;
    barrier();
    float most = 0.0;
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
