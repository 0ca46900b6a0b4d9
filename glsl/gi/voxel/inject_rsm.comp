#version 460
#extension GL_GOOGLE_include_directive : require
// voxel.inject_rsm: every texel of the reflective shadow maps adds its reflected flux to the voxel that it lies in (Hong 2015, section 4.1).
//
// Φ = ρ E A for a parallel light (A: area of a texel across the beam), Φ = ρ I Ω for a perspective map (Ω: solid angle of the texel, Olovsson 2012,
// section 3.3). Sums are 64-bit integers, the same in every run. Per voxel, or per side: Φ / (π h²) for r, g, b [W/(m² sr)], and lit surface in voxel faces.
layout(local_size_x = 8, local_size_y = 8) in;

#include "shared/light_view.glsl"
#include "gi/voxel/grid.glsl"
#include "gi/voxel/records.glsl"

layout(constant_id = 0) const uint SIDES = 1;   // 2: the flux of each side of a voxel apart

layout(std430, set = 1, binding = 0) restrict readonly buffer LightViews { LightView light_views[]; };
layout(set = 1, binding = 1) uniform texture2DArray shadow_maps;
layout(set = 1, binding = 2) uniform utexture2DArray rsm_normal;
layout(set = 1, binding = 3) uniform texture2DArray rsm_reflected;
layout(std430, set = 1, binding = 4) restrict readonly buffer Occupancy { uvec2 occupancy[]; };
layout(std430, set = 1, binding = 5) restrict readonly buffer BlockBases { uint block_bases[]; };
layout(std430, set = 1, binding = 6) restrict buffer Flux { uint flux[]; };   // a side of a voxel: r, g, b, area; each low word, high word
layout(std430, set = 1, binding = 7) restrict buffer LightCounters { uint lost_texels; uint filled_voxels; };
layout(std430, set = 1, binding = 8) restrict readonly buffer Voxels { Voxel voxels[]; };

layout(push_constant) uniform InjectParams {
    vec4 grid;             // xyz: smallest corner of the grid [m]; w: voxel size [m]
    uint resolution;
    float flux_unit;   // of one integer step, for r, g, b [W/(m² sr)]
    float area_unit;   // of one integer step [voxel faces]
} params;

void add(uint side, uint channel, float value) {
    if (value < 1.0) value = floor(value + 0.5);
    if (value <= 0.0) return;
    float high_part = floor(value * (1.0 / 4294967296.0));
    uint low = uint(value - high_part * 4294967296.0), high = uint(high_part);
    uint at = side * 8u + channel * 2u;
    uint before = atomicAdd(flux[at], low);
    if (before + low < before) high += 1u;
    if (high != 0u) atomicAdd(flux[at + 1u], high);
}

// Compact index of the occupied voxel at a grid position, or −1.
int voxel_at(vec3 position) {
    if (any(lessThan(position, vec3(0.0))) || any(greaterThanEqual(position, vec3(params.resolution)))) return -1;
    uvec3 voxel = uvec3(position);
    uint block = block_index(voxel, params.resolution), bit = block_bit(voxel);
    uvec2 words = occupancy[block];
    return block_has(words, bit) ? int(block_bases[block] + set_bits_below(words, bit)) : -1;
}

void main() {
    ivec3 texel = ivec3(gl_GlobalInvocationID);
    LightView view = light_views[texel.z];
    if (any(greaterThanEqual(texel.xy, ivec2(view.light.y)))) return;
    float stored = texelFetch(sampler2DArray(shadow_maps, nearest_clamp), texel, 0).r;
    if (stored == 0.0) return;
    float depth_m = map_depth(view, stored, view.right.w);
    vec2 map = (vec2(texel.xy) + 0.5) / float(view.light.y) * 2.0 - 1.0;
    vec3 across = map.x * view.right.xyz + map.y * view.down.xyz;
    bool parallel = view.origin_kind.w == 0.0;
    vec3 ray = parallel ? view.forward.xyz : view.forward.xyz + across;
    vec3 position = view.origin_kind.xyz + (parallel ? across : vec3(0.0)) + ray * depth_m;
    vec3 normal = unpack_unit(texelFetch(usampler2DArray(rsm_normal, nearest_clamp), texel, 0).r);
    vec3 root = texelFetch(sampler2DArray(rsm_reflected, nearest_clamp), texel, 0).rgb;

    float squared = dot(ray, ray);   // 1 for a parallel light
    float texel_size = 4.0 * length(view.right.xyz) * length(view.down.xyz) / (float(view.light.y) * float(view.light.y));
    float extent = parallel ? texel_size : texel_size / (squared * sqrt(squared));   // A [m²], or Ω [sr]
    vec3 flux_w = root * root * lights[view.light.x].power_outer.rgb * extent;
    float cosine = max(abs(dot(normal, ray)) * inversesqrt(squared), 0.02);
    float area = extent / cosine * (parallel ? 1.0 : depth_m * depth_m * squared);

    float voxel_size = params.grid.w;
    vec3 grid = (position - params.grid.xyz) / voxel_size;
    // It lies in another piece of the grid.
    if (any(lessThan(grid, vec3(0.0))) || any(greaterThanEqual(grid, vec3(params.resolution)))) return;
    int slot = voxel_at(grid);
    // The surface may lie in the neighbour by a rounding error, or by the map's depth error at a grazing angle.
    if (slot < 0) slot = voxel_at(grid + 0.05 * normal);
    if (slot < 0) slot = voxel_at(grid - 0.05 * normal);
    if (slot < 0) slot = voxel_at(grid + 0.5 * normalize(ray));
    if (slot < 0) slot = voxel_at(grid - 0.5 * normalize(ray));
    if (slot < 0) {
        atomicAdd(lost_texels, 1u);
        return;
    }
    uint side = uint(slot);
    if (SIDES == 2u) {
        vec3 lit_side = dot(normal, ray) < 0.0 ? normal : -normal;
        side = 2u * side + uint(dot(lit_side, front_of(voxels[slot])) < 0.0);
    }
    float per_voxel = 1.0 / (PI * voxel_size * voxel_size * params.flux_unit);
    add(side, 0u, flux_w.r * per_voxel);
    add(side, 1u, flux_w.g * per_voxel);
    add(side, 2u, flux_w.b * per_voxel);
    add(side, 3u, area / (voxel_size * voxel_size * params.area_unit));
}
