#version 460
#extension GL_GOOGLE_include_directive : require
// voxel.resolve_opposed: where opposed surfaces of a voxel are parallel, its normal is theirs. Few
// voxels have such; a pass of their own spares all others the sums.
layout(local_size_x = 64) in;

layout(constant_id = 0) const uint EMISSIVE = 0;

#include "gi/shared/voxel/records.glsl"

layout(std430, set = 1, binding = 0) restrict readonly buffer Fragments { Fragment fragments[]; };
layout(std430, set = 1, binding = 1) restrict readonly buffer FragmentEmission {
    uvec2 fragment_emission[];
};
layout(std430, set = 1, binding = 2) restrict readonly buffer Heads { uint heads[]; };
layout(std430, set = 1, binding = 3) restrict buffer Voxels { Voxel voxels[]; };
layout(std430, set = 1, binding = 4) restrict writeonly buffer VoxelEmission {
    vec4 voxel_emission[];
};
layout(std430, set = 1, binding = 5) restrict readonly buffer Opposed { uint opposed[]; };
layout(std430, set = 1, binding = 6) restrict readonly buffer OpposedCount {
    uvec3 opposed_groups;
    uint opposed_count;
};

layout(push_constant) uniform OpposedParams { float emission_unit; } params;

#include "gi/shared/voxel/build/sums.glsl"

// Where at least this share of the squares of opposed surfaces' normals is along one direction,
// they are parallel.
const float PARALLEL = 0.9;

// The direction in which normals lie, of either sign, and the share of them that does: the largest
// eigenvector and eigenvalue of the mean of n nᵀ, by squaring.
vec4 main_direction(mat3 tensor) {
    mat3 power = tensor;
    for (uint i = 0u; i < 4u; ++i) {
        power = power * power;
        power /= power[0][0] + power[1][1] + power[2][2];
    }
    vec3 d = vec3(power[0][0], power[1][1], power[2][2]);
    int most = d.x >= d.y && d.x >= d.z ? 0 : d.y >= d.z ? 1 : 2;
    vec3 direction = normalize(power[most]);
    return vec4(direction, dot(direction, tensor * direction));
}

void resolve(uint index) {
    Sum emission = Sum(uvec3(0u), uvec3(0u));
    SmallSum squares = SmallSum(uvec3(0u), uvec3(0u)), products = squares;
    uint area = 0u, at = heads[index];
    while (at != 0u) {
        Fragment fragment = fragments[at - 1u];
        uint weight = area_of(fragment);
        vec3 n = unpack_unit(fragment.normal_albedo.x);
        area += weight;
        add_small(squares, weight, uvec3(round(n * n * 65535.0)));
        add_small(products, weight, uvec3(round((n * n.yzx + 1.0) * 32767.0)));
        if (EMISSIVE != 0u)
            add_product(emission, weight, unpack_emission(fragment_emission[at - 1u]));
        at = fragment.position_next.y;
    }
    vec3 s = mean(squares, area) / 65535.0, p = mean(products, area) / 32767.0 - 1.0;
    vec4 main = main_direction(mat3(s.x, p.x, p.z, p.x, s.y, p.y, p.z, p.y, s.z));
    if (main.w < PARALLEL) return;
    Voxel voxel = voxels[index];
    uint axis = voxel.coverage >> 30;
    vec3 normal = main[axis] < 0.0 ? -main.xyz : main.xyz;
    voxel.normal = pack_unorm10(normal * 0.5 + 0.5);
    voxels[index].normal = voxel.normal;
    if (EMISSIVE != 0u) {
        vec4 found = emission_of(emission, area, heads[index], front_of(voxel));
        voxel_emission[index] = vec4(found.rgb * (params.emission_unit / 2097151.0), found.a);
    }
}

void main() {
    for (uint i = gl_GlobalInvocationID.x; i < opposed_count; i += 64u * gl_NumWorkGroups.x)
        resolve(opposed[i]);
}
