// What every voxelization method does with a triangle: fetch it, walk a column, append a fragment for each touched voxel.
#ifndef LUMIVOX_EMIT
#define LUMIVOX_EMIT

#include "shared/frame.glsl"
#include "shared/material.glsl"
#include "gi/voxel/grid.glsl"
#include "gi/voxel/records.glsl"
#include "gi/voxel/triangle_box.glsl"

layout(constant_id = 0) const uint EMISSIVE = 0;      // 1: store emission
layout(constant_id = 1) const uint MASKED = 0;        // 1: the material may have a mask

layout(std430, set = 1, binding = 0) restrict buffer Occupancy { uint occupancy[]; };
layout(std430, set = 1, binding = 1) restrict writeonly buffer Fragments { Fragment fragments[]; };
layout(std430, set = 1, binding = 2) restrict writeonly buffer FragmentEmission { uvec2 fragment_emission[]; };
layout(std430, set = 1, binding = 3) restrict buffer Counters { uint fragment_count; uint voxel_count; };

layout(push_constant) uniform Params {
    vec4 origin_inverse_size;   // xyz: smallest corner of the grid [m]; w: 1 / voxel size [1/m]
    uint resolution;            // voxels along an edge of the grid
    uint first_triangle;
    uint triangle_count;
    uint capacity;              // fragments that fit; further ones are counted only
    float emission_unit;        // radiance of the largest stored value, 2²¹ − 1 [W/(m² sr)]
} params;

struct Attributes {
    uint material;
    vec2 uv0, uv1, uv2;
    float lod_area;             // area in texture coordinates per voxel face of surface
};

vec3 grid_position(uint vertex) {
    precise vec3 p = (vertices[vertex].position_u.xyz - params.origin_inverse_size.xyz) * params.origin_inverse_size.w;
    return p;
}

bool fetch_triangle(uint index, out TriangleSetup setup, out Attributes attributes) {
    uvec4 triangle = triangles[index];
    attributes.material = triangle.w;
    attributes.uv0 = texture_uv(vertices[triangle.x]);
    attributes.uv1 = texture_uv(vertices[triangle.y]);
    attributes.uv2 = texture_uv(vertices[triangle.z]);
    bool some = setup_triangle(grid_position(triangle.x), grid_position(triangle.y), grid_position(triangle.z), int(params.resolution), setup);
    vec2 e1 = attributes.uv1 - attributes.uv0, e2 = attributes.uv2 - attributes.uv0;
    attributes.lod_area = abs(e1.x * e2.y - e1.y * e2.x) / max(length(setup.normal), 1e-20);
    return some;
}

// Mip level at which one texel covers one voxel face.
float voxel_lod(Attributes attributes, ivec2 texture_size) {
    return 0.5 * log2(max(attributes.lod_area * float(texture_size.x) * float(texture_size.y), 1e-20));
}

uvec2 pack_emission(vec3 radiance) {
    uvec3 q = uvec3(round(clamp(radiance / params.emission_unit, 0.0, 1.0) * 2097151.0));
    return uvec2(q.x | q.z << 21, q.y | (q.z >> 11) << 21);
}

void emit_fragment(TriangleSetup s, ivec3 local_voxel, Attributes attributes) {
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
    }
    vec3 albedo = material.albedo.rgb * textureLod(sampler2D(albedo_texture, linear_repeat), uv, voxel_lod(attributes, textureSize(sampler2D(albedo_texture, linear_repeat), 0))).rgb;
    uvec3 voxel = uvec3(unpermute(s.base + local_voxel, s.axis));
    vec3 unit_normal = normalize(s.normal);
    uint area = clamp(uint(round(covered * projected_area / abs(unit_normal.z) * AREA_UNIT)), 1u, 65535u);

    uint word = 2u * block_index(voxel, params.resolution) + (block_bit(voxel) >> 5);
    atomicOr(occupancy[word], 1u << (block_bit(voxel) & 31u));
    uint slot = atomicAdd(fragment_count, 1u);
    if (slot >= params.capacity) return;
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
