#version 460
#extension GL_GOOGLE_include_directive : require
// voxel.resolve: area-weighted means over the fragments of each voxel. Sums are 64-bit integers, so
// that they do not depend on the fragments' order, and there is one division at the end. Voxels
// with opposed surfaces are listed: voxel.resolve_opposed goes on with them.
layout(local_size_x = 64) in;

#include "gi/shared/voxel/records.glsl"

layout(constant_id = 0) const uint EMISSIVE = 0;
// 0: a touched voxel is opaque; 1: opacity is the covered fraction of its face
layout(constant_id = 1) const uint COVERAGE = 0;
layout(constant_id = 2) const uint RUNNING = 0;    // 1: albedo is the running average
// opacities of faces: none (0), by the surface that looks their way (1), by all across their axis
// (2)
layout(constant_id = 3) const uint FACES = 0;

layout(std430, set = 1, binding = 0) restrict readonly buffer Fragments { Fragment fragments[]; };
layout(std430, set = 1, binding = 1) restrict readonly buffer FragmentEmission {
    uvec2 fragment_emission[];
};
layout(std430, set = 1, binding = 2) restrict readonly buffer Heads { uint heads[]; };
layout(std430, set = 1, binding = 3) restrict writeonly buffer Voxels { Voxel voxels[]; };
layout(std430, set = 1, binding = 4) restrict writeonly buffer VoxelEmission {
    vec4 voxel_emission[];
};
layout(set = 1, binding = 5, r32ui) uniform restrict readonly uimage3D averages;
// opacity of +x, +y, +z and of −x, −y, −z, 3×10 bits
layout(std430, set = 1, binding = 6) restrict writeonly buffer VoxelFaces { uvec2 voxel_faces[]; };
layout(std430, set = 1, binding = 7) restrict writeonly buffer Opposed { uint opposed[]; };
layout(std430, set = 1, binding = 8) restrict buffer OpposedCount {
    uvec3 opposed_groups;     // of 64 threads
    uint opposed_count;
};

#include "gi/shared/voxel/build/sums.glsl"

layout(push_constant) uniform ResolveParams {
    uint voxel_count;
    float emission_unit;
    uint first_voxel;
}
params;

// Where more than this share of a voxel's surface faces against the rest, it counts as opposed.
const float OPPOSED = 0.25;

// Voxel.coverage; `across`: area across each axis, `net`: the same with the normals' signs, that is
// how much more faces one way than the other. At most one voxel face can be seen from one side.
uint pack_coverage(float covered, vec3 across, vec3 net, bool concave) {
    vec3 along = max(across + net, vec3(0.0)) * 0.5, against = max(across - net, vec3(0.0)) * 0.5;
    vec3 seen_along = min(along, vec3(1.0)), seen_against = min(against, vec3(1.0)),
         hidden = min(along, against);
    vec3 total = vec3(across.x + across.y + across.z);
    vec2 seen = clamp(vec2(dot(max(seen_along, seen_against), 1.0 / total),
                          dot(seen_along + seen_against, 1.0 / total)),
        vec2(1.0 / 255.0), vec2(1.0));
    bool opposed = dot(hidden, 1.0 / total) > OPPOSED;
    uint axis = hidden.x > hidden.y && hidden.x > hidden.z ? 0u : hidden.y > hidden.z ? 1u : 2u;
    if (!opposed) axis = uint(concave);
    return uint(round(covered * 4095.0)) | uint(round(seen.x * 511.0)) << 12
        | uint(round(seen.y * 255.0)) << 21 | uint(opposed) << 29 | axis << 30;
}

// VoxelFaces; `across` and `net` as above. A touched voxel is as opaque as can be on the face that
// most of its surface looks towards, or as covered as that is.
uvec2 pack_faces(vec3 across, vec3 net) {
    vec3 along = max(across + net, vec3(0.0)) * 0.5, against = max(across - net, vec3(0.0)) * 0.5;
    if (FACES == 2u) along = against = across;
    vec3 most = max(along, against);
    float scale = COVERAGE != 0u ? 1.0 : 1.0 / max(most.x, max(most.y, most.z));
    return uvec2(
        pack_unorm10(min(scale * along, vec3(1.0))), pack_unorm10(min(scale * against, vec3(1.0))));
}

// Voxel.across of the same.
uint pack_across(vec3 across, vec3 net) {
    return pack_unorm10(min(0.5 * (across + abs(net)), vec3(1.0)));
}

void main() {
    uint index = gl_GlobalInvocationID.x + gl_GlobalInvocationID.y * 4194240u;
    if (index == 0u) opposed_groups.yz = uvec2(1u);
    if (index >= params.voxel_count) return;
    index += params.first_voxel;
    Sum albedo = Sum(uvec3(0u), uvec3(0u)), emission = albedo;
    SmallSum normal = SmallSum(uvec3(0u), uvec3(0u)), face = normal, position = normal,
             heights = normal;
    uint area = 0u, at = heads[index];
    if (at == 0u) return;   // nothing new in it
    uvec2 place = fragments[at - 1u].place_area;
    while (at != 0u) {
        Fragment fragment = fragments[at - 1u];
        uint weight = area_of(fragment);
        vec3 n = unpack_unit(fragment.normal_albedo.x);
        uvec3 root = unpack_uint10(fragment.normal_albedo.y);
        area += weight;
        add_product(albedo, weight, root * root);
        add_small(normal, weight, uvec3(round((n + 1.0) * 32767.0)));
        add_small(face, weight, uvec3(round(abs(n) * 65535.0)));
        add_small(position, weight, unpack_uint10(fragment.position_next.x));
        float height = dot(unpack_unorm10(fragment.position_next.x), n);
        add_small(heights, weight, uvec3(round((height + 2.0) * 16383.0)));
        if (EMISSIVE != 0u)
            add_product(emission, weight, unpack_emission(fragment_emission[at - 1u]));
        at = fragment.position_next.y;
    }
    vec3 faces = mean(face, 1u) / (65535.0 * AREA_UNIT);
    float covered =
        COVERAGE != 0u ? clamp(max(faces.x, max(faces.y, faces.z)), 1.0 / 255.0, 1.0) : 1.0;
    vec3 mean_normal = mean(normal, area) / 32767.0 - 1.0;
    vec3 albedo_root = sqrt(mean(albedo, area)) / 1023.0;
    if (RUNNING != 0u)
        albedo_root =
            sqrt(unpackUnorm4x8(
                imageLoad(averages, ivec3(voxel_coordinates(place.x, place.y))).r).rgb);
    vec3 net = mean_normal * float(area) / AREA_UNIT;
    vec3 mean_position = mean(position, area) / 1023.0;
    // Of surfaces that look away from each other, each lies further out along its normal than all.
    float height = mean(heights, area).x / 16383.0 - 2.0;
    bool concave = height < dot(mean_position, mean_normal);
    uint coverage = pack_coverage(covered, faces, net, concave);
    Voxel voxel = Voxel(place.x,
        place.y & 0xffffu | packHalf2x16(vec2(float(area) / AREA_UNIT, 0.0)) << 16,
        pack_unorm10(mean_normal * 0.5 + 0.5), pack_unorm10(albedo_root),
        pack_unorm10(mean_position), coverage, pack_across(faces, net));
    voxels[index] = voxel;
    if (is_opposed(voxel)) {
        uint slot = atomicAdd(opposed_count, 1u);
        opposed[slot] = index;
        atomicMax(opposed_groups.x, min(slot / 64u + 1u, 65535u));
    }
    if (FACES != 0u) voxel_faces[index] = pack_faces(faces, net);
    if (EMISSIVE != 0u) {
        vec4 found = emission_of(emission, area, heads[index], front_of(voxel));
        voxel_emission[index] = vec4(found.rgb * (params.emission_unit / 2097151.0), found.a);
    }
}
