// What every voxelization method does with a touched voxel: mark it, and append a fragment.
#ifndef LUMIVOX_EMIT
#define LUMIVOX_EMIT

#include "shared/material.glsl"
#include "gi/shared/voxel/grid.glsl"
#include "gi/shared/voxel/records.glsl"
#include "gi/shared/voxel/build/fetch.glsl"

layout(constant_id = 0) const uint EMISSIVE = 0;      // 1: store emission
layout(constant_id = 1) const uint MASKED = 0;        // 1: the material has a mask
layout(constant_id = 2) const uint TEXTURED = 0;      // 1: the material has a texture of any kind

layout(std430, set = 1, binding = 0) restrict buffer Occupancy { uint occupancy[]; };
layout(std430, set = 1, binding = 1) restrict buffer Fragments { Fragment fragments[]; };
layout(std430, set = 1, binding = 2) restrict buffer FragmentEmission {
    uvec2 fragment_emission[];
};
layout(std430, set = 1, binding = 3) restrict buffer Counters {
    uint fragment_count;
    uint voxel_count;
    uint unfinished_count;
};

// Texture coordinates at the fragment's centroid, and the area in texture coordinates of one voxel
// face of surface.
struct TexturePosition {
    vec2 uv;
    float face_area;
};

// `position` in the dominant projection.
TexturePosition texture_position(TriangleSetup s, uint triangle, vec2 position) {
    uvec3 at = vertices_of(triangle);
    vec2 uv0 = texture_uv(at.x), uv1 = texture_uv(at.y) - uv0, uv2 = texture_uv(at.z) - uv0;
    vec2 p = position - s.v0.xy, e1 = s.v1.xy - s.v0.xy, e2 = s.v2.xy - s.v0.xy;
    vec2 b = clamp(vec2(p.x * e2.y - p.y * e2.x, e1.x * p.y - e1.y * p.x) / s.normal.z, 0.0, 1.0);
    return TexturePosition(uv0 + b.x * uv1 + b.y * uv2,
        abs(uv1.x * uv2.y - uv1.y * uv2.x) / max(length(s.normal), 1e-20));
}

// Samples at the mip whose texel covers one voxel face.
vec4 sample_texture(texture2D image, TexturePosition at) {
    vec2 size = vec2(textureSize(sampler2D(image, linear_repeat), 0));
    return textureLod(sampler2D(image, linear_repeat), at.uv,
        0.5 * log2(max(at.face_area * size.x * size.y, 1e-20)));
}

uvec2 pack_emission(vec3 radiance) {
    uvec3 q = uvec3(round(clamp(radiance / params.emission_unit, 0.0, 1.0) * 2097151.0));
    return uvec2(q.x | q.z << 21, q.y | (q.z >> 11) << 21);
}

// The word that has a voxel's bit, and that bit alone.
uvec2 mark_of(uvec3 voxel) {
    uint bit = block_bit(voxel);
    return uvec2(2u * block_index(voxel, params.resolution) + (bit >> 5), 1u << (bit & 31u));
}

void mark(uvec3 voxel) {
    uvec2 own = mark_of(voxel);
    atomicOr(occupancy[own.x], own.y);
}

// First of `count` consecutive places in the list. What a mask leaves is not known yet: masked
// fragments find their places one by one.
uint reserve(uint count) {
    return MASKED != 0u ? 0u : atomicAdd(fragment_count, count);
}

// What all fragments of a triangle share.
struct Surface {
    uint normal;          // packed
    float area_steps;     // steps of stored area in a voxel face, seen along the dominant axis
    vec3 albedo;
    vec3 emission;        // [W/(m² sr)]
};

Surface surface_of(TriangleSetup s) {
    Material material = materials[params.material];
    vec3 normal = normalize(s.normal);
    return Surface(pack_unit(unpermute(normal, s.axis)), AREA_UNIT / abs(normal.z),
        material.albedo.rgb * (1.0 - material.metalness.x), material.emission.rgb);
}

// Stores the fragment of a voxel; `inside`: mean position and area [steps] of the triangle's part.
void store_fragment(TriangleSetup s, Surface surface, uint triangle, ivec3 local_voxel, uint slot,
    vec4 inside) {
    uvec3 voxel = uvec3(unpermute(s.base + local_voxel, s.axis));
    TexturePosition at;
    if (TEXTURED != 0u) at = texture_position(s, triangle, vec2(local_voxel.xy) + inside.xy);
    vec3 albedo = surface.albedo;
    if (TEXTURED != 0u) albedo *= sample_texture(albedo_texture, at).rgb;
    uint area = clamp(uint(round(inside.w)), 1u, 65535u);
    fragments[slot].place_area = uvec2(voxel.x | voxel.y << 16, voxel.z | area << 16);
    fragments[slot].normal_albedo = uvec2(surface.normal, pack_unorm10(sqrt(albedo)));
    fragments[slot].position_next.x = pack_unorm10(unpermute(inside.xyz, s.axis));
    if (EMISSIVE != 0u) {
        vec3 emission = surface.emission;
        if (TEXTURED != 0u) emission *= sample_texture(emission_texture, at).rgb;
        fragment_emission[slot] = pack_emission(emission);
    }
}

// Stores the fragment of a voxel in its place where there is one. A mask leaves a part of the
// fragment or nothing; what it leaves is marked and finds its place here. `has_edges`: as in
// area_inside(). Called in few places: drivers take long to compile each.
void place_fragment(TriangleSetup s, Surface surface, uint triangle, ivec3 local_voxel, uint slot,
    bool has_edges) {
    vec3 mean_position;
    float area = area_inside(s, local_voxel, has_edges, mean_position) * surface.area_steps;
    if (MASKED != 0u) {
        TexturePosition at =
            texture_position(s, triangle, vec2(local_voxel.xy) + mean_position.xy);
        float covered = sample_texture(mask_texture, at).r;
        if (covered < 0.5) return;
        area *= covered;
        mark(uvec3(unpermute(s.base + local_voxel, s.axis)));
        slot = atomicAdd(fragment_count, 1u);
    }
    if (slot >= params.capacity) return;
    store_fragment(s, surface, triangle, local_voxel, slot, vec4(mean_position, area));
}

// Marks one touched voxel of triangle number `triangle` as occupied, and stores the fragment in its
// place.
void emit_fragment(TriangleSetup s, Surface surface, uint triangle, ivec3 local_voxel, uint slot) {
    if (MASKED == 0u) mark(uvec3(unpermute(s.base + local_voxel, s.axis)));
    place_fragment(s, surface, triangle, local_voxel, slot, true);
}

#endif
