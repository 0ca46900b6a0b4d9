// What every voxelization method does with a triangle: walk a column, append a fragment for each touched voxel.
#ifndef LUMIVOX_EMIT
#define LUMIVOX_EMIT

#include "shared/material.glsl"
#include "gi/voxel/grid.glsl"
#include "gi/voxel/records.glsl"
#include "gi/voxel/fetch.glsl"

layout(constant_id = 0) const uint EMISSIVE = 0;      // 1: store emission
layout(constant_id = 1) const uint MASKED = 0;        // 1: the material may have a mask

layout(std430, set = 1, binding = 0) restrict buffer Occupancy { uint occupancy[]; };
layout(std430, set = 1, binding = 1) restrict buffer Fragments { Fragment fragments[]; };
layout(std430, set = 1, binding = 2) restrict buffer FragmentEmission { uvec2 fragment_emission[]; };
layout(std430, set = 1, binding = 3) restrict buffer Counters { uint fragment_count; uint voxel_count; };

// Mip level at which one texel covers one voxel face.
float voxel_lod(Attributes attributes, ivec2 texture_size) {
    return 0.5 * log2(max(attributes.lod_area * float(texture_size.x) * float(texture_size.y), 1e-20));
}

uvec2 pack_emission(vec3 radiance) {
    uvec3 q = uvec3(round(clamp(radiance / params.emission_unit, 0.0, 1.0) * 2097151.0));
    return uvec2(q.x | q.z << 21, q.y | (q.z >> 11) << 21);
}

// Marks the voxel as occupied and counts the fragment; its place in the list.
uint append(uvec3 voxel) {
    uint bit = block_bit(voxel);
    atomicOr(occupancy[2u * block_index(voxel, params.resolution) + (bit >> 5)], 1u << (bit & 31u));
    return atomicAdd(fragment_count, 1u);
}

void emit_fragment(TriangleSetup s, ivec3 local_voxel, Attributes attributes) {
    uvec3 voxel = uvec3(unpermute(s.base + local_voxel, s.axis));
    uint slot;
    if (MASKED == 0u) {
        slot = append(voxel);
        if (slot >= params.capacity) return;
    }
    vec3 mean_position;
    float projected_area = area_inside(s, local_voxel, mean_position);
    // Barycentric coordinates of the mean_position, in the dominant projection.
    vec2 p = vec2(local_voxel.xy) + mean_position.xy - s.v0.xy, e1 = s.v1.xy - s.v0.xy, e2 = s.v2.xy - s.v0.xy;
    vec2 b = clamp(vec2(p.x * e2.y - p.y * e2.x, e1.x * p.y - e1.y * p.x) / s.normal.z, 0.0, 1.0);
    vec2 uv = attributes.uv0 + b.x * (attributes.uv1 - attributes.uv0) + b.y * (attributes.uv2 - attributes.uv0);
    Material material = materials[attributes.material];
    float covered = 1.0;
    if (MASKED != 0u) {
        covered = textureLod(sampler2D(mask_texture, linear_repeat), uv, voxel_lod(attributes, textureSize(sampler2D(mask_texture, linear_repeat), 0))).r;
        if (covered < 0.5) return;
        slot = append(voxel);
        if (slot >= params.capacity) return;
    }
    vec3 albedo = material.albedo.rgb * (1.0 - material.metalness.x) * textureLod(sampler2D(albedo_texture, linear_repeat), uv, voxel_lod(attributes, textureSize(sampler2D(albedo_texture, linear_repeat), 0))).rgb;
    vec3 unit_normal = normalize(s.normal);
    uint area = clamp(uint(round(covered * projected_area / abs(unit_normal.z) * AREA_UNIT)), 1u, 65535u);
    fragments[slot] = Fragment(voxel.x | voxel.y << 16, voxel.z | area << 16, pack_unit(unpermute(unit_normal, s.axis)), pack_unorm10(sqrt(albedo)),
                               pack_unorm10(unpermute(mean_position, s.axis)), 0u);
    if (EMISSIVE != 0u) {
        vec3 emission = material.emission.rgb;
        emission *= textureLod(sampler2D(emission_texture, linear_repeat), uv, voxel_lod(attributes, textureSize(sampler2D(emission_texture, linear_repeat), 0))).rgb;
        fragment_emission[slot] = pack_emission(emission);
    }
}

// Appends a fragment for every touched voxel of one column along the dominant axis; `column` is relative to s.base.
void voxelize_column(TriangleSetup s, ivec2 column, Attributes attributes) {
    if (!touches_column(s, column)) return;
    ivec2 range = depth_range(s, column);
    for (int z = range.x; z <= range.y; ++z) {
        if (touches(s, ivec3(column, z))) emit_fragment(s, ivec3(column, z), attributes);
    }
}

#endif
