#version 460
#extension GL_GOOGLE_include_directive : require
// voxel.light: the radiance of each occupied voxel, from the flux injected into it (or, with INJECTION_VOXEL, from its own albedo, normal and the
// shadow maps), plus what it emits. A voxel that no texel fell into although the light reaches it is a hole of the sampling: it is lit from its own
// attributes and counted.
layout(local_size_x = 64) in;

#include "shared/light_view.glsl"
#include "gi/voxel/flux.glsl"
#include "gi/voxel/records.glsl"

layout(constant_id = 0) const uint INJECTION_VOXEL = 0;
layout(constant_id = 1) const uint EMISSIVE = 0;
layout(constant_id = 2) const uint SIDES = 1;   // 2: a radiance for each side of a voxel, front first

layout(std430, set = 1, binding = 0) restrict readonly buffer LightViews { LightView light_views[]; };
layout(set = 1, binding = 1) uniform texture2DArray shadow_maps;
layout(std430, set = 1, binding = 2) restrict readonly buffer Voxels { Voxel voxels[]; };
layout(std430, set = 1, binding = 3) restrict readonly buffer VoxelEmission { vec4 voxel_emission[]; };   // mean; w: share that leaves the front
layout(std430, set = 1, binding = 4) restrict readonly buffer Flux { uint flux[]; };
layout(std430, set = 1, binding = 5) restrict writeonly buffer VoxelRadiance { uvec2 voxel_radiance[]; };   // a side: half floats r, g, b, opacity
layout(std430, set = 1, binding = 6) restrict buffer LightCounters { uint lost_texels; uint filled_voxels; };
#ifdef DENSE
layout(set = 1, binding = 7, rgba16f) uniform restrict writeonly image3D dense_radiance;
#endif

layout(push_constant) uniform LightParams {
    vec4 grid;             // xyz: smallest corner of the grid [m]; w: voxel size [m]
    uint voxel_count; float flux_unit; float area_unit; } params;

#include "shared/visibility.glsl"

const float LARGEST_HALF = 65504.0;
// Below this much surface in a voxel [faces], which texels fall into it is mere chance.
const float SLIVER = 0.1;

float injected(uint side, uint channel) {
    uint at = FLUX_WORDS * side;
    return float(flux[at + 4u] >> 8u * channel & 255u) * 4294967296.0 + float(flux[at + channel]);
}

// Depth differences that still count as lit [m]. A voxel of several planes has no tangent plane that its neighbours in the map lie on: in a corner of a
// room they are nearer to the light by about a texel.
float visibility_slack(Light light, vec3 position, bool one_plane) {
    LightView view = light_views[light.views.x];
    float distance_m = view.origin_kind.w == 0.0 ? 1.0 : length(position - view.origin_kind.xyz);
    float texel_m = 2.0 * length(view.right.xyz) * distance_m / float(view.light.y);
    return max(0.25 * params.grid.w, one_plane ? 0.0 : 2.0 * texel_m);
}

// ρ/π Σ E |n·ω| V at the voxel's mean position; with two sides, of the light on the side that `normal` points to.
vec3 shade(Voxel voxel, vec3 normal, bool one_plane) {
    float size = params.grid.w;
    vec3 position = params.grid.xyz + size * (voxel_coordinates(voxel.xy, voxel.z_area) + unpack_unorm10(voxel.mean_position));
    vec3 irradiance = vec3(0.0);
    for (uint i = 0u; i < frame.size_px.z; ++i) {
        vec3 to_light;
        vec3 arriving = light_irradiance(lights[i], position, to_light);
        float cosine = dot(normal, to_light);
        if (SIDES == 2u) cosine = max(cosine, 0.0);
        vec3 lit_side = cosine < 0.0 ? -normal : normal;
        irradiance += arriving * abs(cosine) * light_visibility(lights[i], position, lit_side, visibility_slack(lights[i], position, one_plane));
    }
    return unpack_albedo(voxel.albedo) / PI * irradiance;
}

// Share of the voxel's surface that its radiance, or that of one side of it, is the mean of.
float seen_share(Voxel voxel) {
    vec2 seen = unpack_seen(voxel.coverage);
    return SIDES == 2u ? seen.x : seen.y;
}

// Radiance of a voxel, or of one side of it; `normal` points to that side.
vec3 reflected(Voxel voxel, uint side, vec3 normal, bool one_plane) {
    if (INJECTION_VOXEL != 0u) return shade(voxel, normal, one_plane);
    float lit = injected(side, 3u) * params.area_unit;
    if (lit == 0.0) {
        vec3 radiance = shade(voxel, normal, one_plane);
        if (any(greaterThan(radiance, vec3(0.0)))) atomicAdd(filled_voxels, 1u);
        return radiance;
    }
    float area = unpackHalf2x16(voxel.z_area >> 16).x;
    area *= seen_share(voxel);
    return vec3(injected(side, 0u), injected(side, 1u), injected(side, 2u)) * params.flux_unit / (area > SLIVER ? area : max(area, lit));
}

void main() {
    uint index = gl_GlobalInvocationID.x + gl_GlobalInvocationID.y * 4194240u;
    if (index >= params.voxel_count) return;
    Voxel voxel = voxels[index];
    vec3 mean_normal = unpack_mean_normal(voxel.normal);
    bool one_plane = dot(mean_normal, mean_normal) >= 0.9;
    float opacity = unpack_coverage(voxel.coverage);
    vec3 normal = SIDES == 2u ? front_of(voxel) : mean_normal / max(length(mean_normal), 1e-6);
    vec4 emission = EMISSIVE != 0u ? voxel_emission[index] : vec4(0.0);
    emission.rgb /= seen_share(voxel);
    vec3 mean_radiance = vec3(0.0);
    for (uint side = 0u; side < SIDES; ++side) {
        vec3 radiance = reflected(voxel, SIDES * index + side, side == 0u ? normal : -normal, one_plane);
        radiance += emission.rgb * (SIDES == 1u ? 1.0 : side == 0u ? emission.w : 1.0 - emission.w);
        radiance = min(radiance, vec3(LARGEST_HALF));
        voxel_radiance[SIDES * index + side] = uvec2(packHalf2x16(radiance.rg), packHalf2x16(vec2(radiance.b, opacity)));
        mean_radiance += radiance;
    }
#ifdef DENSE
    vec2 seen = unpack_seen(voxel.coverage);
    if (SIDES == 2u) mean_radiance *= seen.x / seen.y;
    imageStore(dense_radiance, ivec3(voxel_coordinates(voxel.xy, voxel.z_area)), vec4(mean_radiance * opacity, opacity));
#endif
}
