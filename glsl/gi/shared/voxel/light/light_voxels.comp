#version 460
#extension GL_GOOGLE_include_directive : require
// voxel.light: the radiance of each occupied voxel, from the flux injected into it (or, with
// INJECTION_VOXEL, from its own albedo, normal and the shadow maps or rays), plus what it emits,
// plus what it reflects of the light that voxel.bounce gathered. A voxel that no texel fell into
// although the light reaches it is a hole of the sampling: it is lit from its own attributes and
// counted.
layout(local_size_x = 64) in;

#include "shared/light_view.glsl"
#include "gi/shared/voxel/light/flux.glsl"
#include "gi/shared/voxel/records.glsl"

#ifdef TRIANGLES
#include "render/bvh/bindings.glsl"
#define BINDING(n) (5 + n)
#define CONSTANT(n) (3 + n)
#else
#define BINDING(n) n
#define CONSTANT(n) n
#endif

layout(constant_id = CONSTANT(0)) const uint INJECTION_VOXEL = 0;
layout(constant_id = CONSTANT(1)) const uint EMISSIVE = 0;
// 2: a radiance for each side of a voxel, front first; 6: for each face
layout(constant_id = CONSTANT(2)) const uint SIDES = 1;
layout(constant_id = CONSTANT(3)) const uint INDIRECT = 0;   // with what voxel.bounce gathered
// holes are counted; not when the same voxels are lit again in one frame
layout(constant_id = CONSTANT(4)) const uint COUNTING = 1;
layout(constant_id = CONSTANT(5)) const uint NORMAL_WEIGHTED = 0;
// by shadow maps (0), from half a voxel off the surface (1), by rays: hard (2), soft (3), as 0 but
// of several planes by area (4), by rays against triangles from points of the surface (5)
layout(constant_id = CONSTANT(6)) const uint OCCLUSION = 0;
// 1: a voxel's record may stand back for one behind it, which is of dynamic geometry too
layout(constant_id = CONSTANT(7)) const uint DYNAMIC = 0;
// 1: into six faces; of a voxel without a dense texel its radiances are those of the faces
layout(constant_id = CONSTANT(8)) const uint FACES = 0;

layout(std430, set = 1, binding = BINDING(0)) restrict readonly buffer LightViews {
    LightView light_views[];
};
layout(set = 1, binding = BINDING(1)) uniform texture2DArray shadow_maps;
layout(std430, set = 1, binding = BINDING(2)) restrict readonly buffer Voxels { Voxel voxels[]; };
// mean; w: share that leaves the front
layout(std430, set = 1, binding = BINDING(3)) restrict readonly buffer VoxelEmission {
    vec4 voxel_emission[];
};
layout(std430, set = 1, binding = BINDING(4)) restrict readonly buffer Flux { uint flux[]; };
// a side or face: half floats r, g, b, and opacity or a weight (gi/shared/voxel/light/merged.glsl)
layout(std430, set = 1, binding = BINDING(5)) restrict writeonly buffer VoxelRadiance {
    uvec2 voxel_radiance[];
};
layout(std430, set = 1, binding = BINDING(6)) restrict buffer LightCounters {
    uint lost_texels;
    uint filled_voxels;
};
// a side: E/π of the bounces, half floats
layout(std430, set = 1, binding = BINDING(7)) restrict readonly buffer VoxelIrradiance {
    uvec2 voxel_irradiance[];
};
layout(std430, set = 1, binding = BINDING(8)) restrict readonly buffer Occupancy {
    uvec2 occupancy[];
};
layout(std430, set = 1, binding = BINDING(9)) restrict readonly buffer BlockBases {
    uint block_bases[];
};
// opacity of +x, +y, +z and of −x, −y, −z, 3×10 bits
layout(std430, set = 1, binding = BINDING(10)) restrict readonly buffer VoxelFaces {
    uvec2 voxel_faces[];
};
#ifdef TRIANGLES
layout(constant_id = 12) const uint POINTS = 16;   // of a voxel's surface, for each light
#define NORMALS_CONSTANT 13
#else
#define NORMALS_CONSTANT 9
#endif
#ifdef DENSE
// 1: the texel has both sides together, and a second one the mean normal of what shines
layout(constant_id = NORMALS_CONSTANT) const uint NORMALS = 0;

#include "gi/shared/voxel/light/lit_normals.glsl"

layout(set = 1, binding = BINDING(11), rgba16f) uniform restrict writeonly image3D dense_radiance;
layout(set = 1, binding = BINDING(12), rgba16f) uniform restrict writeonly image3D dense_normals;
#endif

layout(push_constant) uniform LightParams {
    vec4 grid;             // xyz: corner that places are counted from [m]; w: voxel size [m]
    ivec4 first;           // xyz: smallest corner of the voxels' grid from there [voxels]
    ivec4 kept_low;        // box of voxels, counted from there, whose light stays as it is
    ivec4 kept_end;
    uint voxel_count;
    float flux_unit;
    float area_unit;
    uint resolution;       // voxels along an edge of the grid
    float kappa;           // κ of soft occlusion [voxels]
} params;

#include "shared/visibility.glsl"
#include "gi/shared/voxel/trace/trace.glsl"
#include "gi/shared/voxel/trace/dense.glsl"

Voxel surface_of(uint slot) {
    return voxels[slot];
}

// Below this much surface in a voxel [faces], which texels fall into it is mere chance.
const float SLIVER = 0.1;

float injected(uint side, uint channel) {
    uint at = FLUX_WORDS * side;
    return float(flux[at + 4u] >> 8u * channel & 255u) * 4294967296.0 + float(flux[at + channel]);
}

// Depth differences that still count as lit [m]. A voxel of several planes has no tangent plane
// that its neighbours in the map lie on: in a corner of a room they are nearer to the light by
// about a texel.
float visibility_slack(Light light, vec3 position, bool one_plane) {
    bool parallel = light.position_kind.w == LIGHT_DIRECTIONAL;
    uint index = light.views.x;
    if (parallel) index = view_of(light, light.views.xy, position);
    LightView view = light_views[index];
    float distance_m = parallel ? 1.0 : length(position - view.origin_kind.xyz);
    float texel_m = 2.0 * length(view.right.xyz) * distance_m / float(view.light.y);
    return max(0.25 * params.grid.w, one_plane ? 0.0 : 2.0 * texel_m);
}

// |n·ω|, or max(n·ω, 0) of the side that `normal` points to. Normal-weighted: Σ N_k² D_k over the
// faces of the voxel that its mean normal N is on the side of, D_k = max(±ω_k, 0) (Villegas &
// Ramírez, equations 3 to 5).
float attenuation(Voxel voxel, vec3 normal, vec3 to_light) {
    if (NORMAL_WEIGHTED == 0u) {
        float cosine = dot(normal, to_light);
        return SIDES == 1u ? abs(cosine) : max(cosine, 0.0);
    }
    vec3 mean_normal = normalize(unpack_mean_normal(voxel.normal));
    vec3 side = dot(mean_normal, normal) < 0.0 ? -sign(mean_normal) : sign(mean_normal);
    return dot(
        mean_normal * mean_normal, SIDES == 1u ? abs(to_light) : max(side * to_light, vec3(0.0)));
}

// as the defaults of voxel.gather_rays [voxels]
const float RAY_START = 0.05, SELF_HEIGHT = 0.1, CONTOUR_SLACK = 0.1;

// How far behind `from` the map's surface is, and `to`, along the light [m].
vec2 mapped_depths(Light light, vec3 from, vec3 to) {
    uint index = view_of(light, light.views.xy, from);
    LightView view = light_views[index];
    vec3 map = project(view, from);
    if (map.z <= 0.0 || any(greaterThan(abs(map.xy), vec2(1.0)))) return vec2(-1.0);
    vec2 texel = clamp(
        (map.xy * 0.5 + 0.5) * float(view.light.y), vec2(0.0), vec2(float(view.light.y) - 0.5));
    float stored = map_depth(view,
        texelFetch(sampler2DArray(shadow_maps, nearest_clamp), ivec3(texel, index), 0).r,
        view.right.w);
    return vec2(stored, project(view, to).z) - map.z;
}

// Fraction of a light that reaches a voxel's surface. `seed` is the voxel's.
float unoccluded(
    Light light, vec3 position, vec3 to_light, vec3 lit_side, bool one_plane, uint seed) {
    float size = params.grid.w;
    vec3 receiver = (position - params.grid.xyz) / size - vec3(params.first),
         origin = receiver + RAY_START * lit_side;
    float reach = light.position_kind.w == LIGHT_DIRECTIONAL
        ? 1e30
        : length(light.position_kind.xyz - position) / size;
    TraceSettings settings = TraceSettings(
        params.resolution, SELF_HEIGHT, CONTOUR_SLACK, seed, 0u);
    bool traces = OCCLUSION == 3u;
    float kappa = params.kappa;
    if (OCCLUSION == 2u) {
        // Beyond any κ the first voxel that is hit hides all.
        kappa = 1e30;
        traces = true;
    }
    if (traces) {
        return 1.0 - soft_occlusion(origin, to_light, receiver, lit_side, settings, reach, kappa);
    }
    vec3 from = OCCLUSION == 1u ? position + 0.5 * size * lit_side : position;
    float slack_m = visibility_slack(light, position, one_plane);
    return light_visibility(light, from, lit_side, slack_m, false);
}

// Share of the voxel's surface that its radiance, or that of one side of it, is the mean of.
float seen_share(Voxel voxel) {
    vec2 seen = unpack_seen(voxel.coverage);
    return SIDES == 1u ? seen.y : seen.x;
}

const uint ALONG = 3u;   // rays along each edge of a face

// Area that a light meets first in a voxel, as the light sees it [voxel faces]: of 3×3 rays through
// each face that looks to the light, those which the shadow map ends between where they enter the
// voxel and where they leave it.
float lit_area(Light light, vec3 corner, vec3 to_light) {
    float area = 0.0;
    for (uint i = 0u; i < 3u * ALONG * ALONG; ++i) {
        uint axis = i / (ALONG * ALONG);
        vec2 on_face = (vec2(i % ALONG, i / ALONG % ALONG) + 0.5) / float(ALONG);
        vec3 entry = axis == 0u ? vec3(0.0, on_face)
            : axis == 1u        ? vec3(on_face.y, 0.0, on_face.x)
                                : vec3(on_face, 0.0);
        entry[axis] = to_light[axis] > 0.0 ? 1.0 : 0.0;
        vec3 from = corner + params.grid.w * entry, towards = to_light;
        if (light.position_kind.w != LIGHT_DIRECTIONAL)
            towards = normalize(light.position_kind.xyz - from);
        vec3 ways = mix(1.0 - entry, entry, greaterThan(towards, vec3(0.0)))
            / max(abs(towards), vec3(1e-6));
        vec2 depths = mapped_depths(
            light, from, from - params.grid.w * min(ways.x, min(ways.y, ways.z)) * towards);
        if (depths.x >= 0.0 && depths.x < depths.y)
            area += max(towards[axis] * sign(to_light[axis]), 0.0);
    }
    return area / float(ALONG * ALONG);
}

// ρ/π Σ E |n·ω| V at the voxel's mean position; with two sides, of the light on the side that
// `normal` points to. By area, |n·ω| V of a voxel of several planes is the share of its surface
// that the light meets first, as the light sees it; of what the voxel's mean normal lets through,
// no more.
vec3 shade(Voxel voxel, vec3 normal, bool one_plane) {
    float size = params.grid.w;
    vec3 position = params.grid.xyz
        + size
            * (voxel_coordinates(voxel.xy, voxel.z_area) + vec3(params.first)
                + unpack_unorm10(voxel.mean_position));
    vec3 irradiance = vec3(0.0);
    for (uint i = 0u; i < frame.size_px.z; ++i) {
        vec3 to_light;
        vec3 arriving = light_irradiance(lights[i], position, to_light);
        if (OCCLUSION == 4u && !one_plane) {
            float area = unpackHalf2x16(voxel.z_area >> 16).x * seen_share(voxel);
            float lit = SIDES != 1u && dot(normal, to_light) <= 0.0
                ? 0.0
                : lit_area(
                      lights[i], position - size * unpack_unorm10(voxel.mean_position), to_light);
            irradiance +=
                arriving * min(lit / max(area, 1e-6), attenuation(voxel, normal, to_light));
            continue;
        }
        vec3 lit_side = SIDES == 1u && dot(normal, to_light) < 0.0 ? -normal : normal;
        uint seed = seed_of(uvec3(voxel_coordinates(voxel.xy, voxel.z_area)), 0u);
        irradiance += arriving * attenuation(voxel, normal, to_light)
            * unoccluded(lights[i], position, to_light, lit_side, one_plane, seed);
    }
    return unpack_albedo(voxel.albedo) / PI * irradiance;
}

// Area of surface [voxel faces] that a radiance is the mean of.
float area_of(Voxel voxel, uint side) {
    if (SIDES == 6u) return unpack_unorm10(voxel.across)[side % 6u >> 1];
    return unpackHalf2x16(voxel.z_area >> 16).x * seen_share(voxel);
}

#ifdef TRIANGLES
#include "gi/shared/voxel/light/lit_points.glsl"
#endif

// ρ/π E of a voxel, or of one side or face of it, without maps of its flux.
vec3 shade_side(Voxel voxel, uint side, vec3 normal, bool one_plane) {
#ifdef TRIANGLES
    return of_points[side % SIDES];
#else
    return shade(voxel, normal, one_plane);
#endif
}

// Radiance of a voxel, or of one side or face of it; `normal` points to that side.
vec3 reflected(Voxel voxel, uint side, vec3 normal, bool one_plane) {
    if (INJECTION_VOXEL != 0u) return shade_side(voxel, side, normal, one_plane);
    float lit = injected(side, 3u) * params.area_unit;
    if (lit == 0.0) {
        vec3 radiance = shade_side(voxel, side, normal, one_plane);
        if (COUNTING != 0u && any(greaterThan(radiance, vec3(0.0)))) atomicAdd(filled_voxels, 1u);
        return radiance;
    }
    float area = area_of(voxel, side);
    return vec3(injected(side, 0u), injected(side, 1u), injected(side, 2u)) * params.flux_unit
        / (area > SLIVER ? area : max(area, lit));
}

// ρ/π E of the light that reaches a voxel, or one side of it, from other voxels.
vec3 indirect(Voxel voxel, uint side) {
    if (INDIRECT == 0u) return vec3(0.0);
    uvec2 packed = voxel_irradiance[side];
    return unpack_albedo(voxel.albedo) * vec3(unpackHalf2x16(packed.x), unpackHalf2x16(packed.y).x);
}

// Whether the voxel's compact index is that of this record.
bool is_current(uint index, Voxel voxel) {
    uvec3 at = uvec3(voxel_coordinates(voxel.xy, voxel.z_area));
    uint block = block_index(at, params.resolution);
    return block_bases[block] + set_bits_below(occupancy[block], block_bit(at)) == index;
}

// Radiance, and opacity in w, of a face (+x, −x, +y, −y, +z, −z) of a voxel whose sides have these
// radiances: the radiance of the side that the face is on, or an equal share of both.
vec4 face_radiance(uint index, uint face, vec3 normal, vec3 sides[2]) {
    uint axis = face >> 1;
    float opacity = unpack_unorm10(voxel_faces[index][face & 1u])[axis];
    float towards = (face & 1u) == 0u ? normal[axis] : -normal[axis];
    return vec4(
        SIDES == 1u ? sides[0] : mix(sides[1], sides[0], 0.5 + 0.5 * sign(towards)), opacity);
}

void store_side(uint index, uint side, vec3 radiance, float beside) {
    voxel_radiance[SIDES * index + side] =
        uvec2(packHalf2x16(radiance.rg), packHalf2x16(vec2(radiance.b, beside)));
}

// What goes with the radiance of a face: with −x the opacity, with +x, +y and +z what radiances
// along the axis are multiplied by for a single one.
float face_weight(Voxel voxel, vec3 areas, float opacity, uint face) {
    vec2 seen = unpack_seen(voxel.coverage);
    float weight = areas[face >> 1] / max(areas.x + areas.y + areas.z, 1e-6) * seen.x / seen.y;
    return (face & 1u) == 0u ? weight : opacity;
}

void main() {
    uint index = gl_GlobalInvocationID.x + gl_GlobalInvocationID.y * 4194240u;
    if (index >= params.voxel_count) return;
    Voxel voxel = voxels[index];
    ivec3 place = ivec3(voxel_coordinates(voxel.xy, voxel.z_area)) + params.first.xyz;
    if (all(greaterThanEqual(place, params.kept_low.xyz))
        && all(lessThan(place, params.kept_end.xyz)))
        return;
    if (DYNAMIC != 0u && !is_current(index, voxel)) {
        // Nothing looks for it, but the octree's static bricks hold it: dark, as long as it stands
        // back.
        uvec2 dark = uvec2(0u, packHalf2x16(vec2(0.0, unpack_coverage(voxel.coverage))));
        for (uint side = 0u; side < SIDES; ++side) voxel_radiance[SIDES * index + side] = dark;
        return;
    }
    vec3 mean_normal = unpack_mean_normal(voxel.normal);
    bool one_plane = is_one_plane(mean_normal) && !is_opposed(voxel);
    float opacity = unpack_coverage(voxel.coverage);
    vec3 normal = SIDES == 2u ? front_of(voxel) : mean_normal / max(length(mean_normal), 1e-6);
    vec4 emission = EMISSIVE != 0u ? voxel_emission[index] : vec4(0.0);
    emission.rgb /= seen_share(voxel);
    vec3 areas = unpack_unorm10(voxel.across), front = front_of(voxel);
    vec3 mean_radiance = vec3(0.0), mean_indirect = vec3(0.0), sides[2];
#ifdef TRIANGLES
    light_points(voxel, normal, one_plane);
#endif
    // One loop for sides and faces: drivers take long to compile what light comes by, each time.
    for (uint side = 0u; side < SIDES; ++side) {
        uint slot = SIDES * index + side;
        vec3 own_normal = side == 0u ? normal : -normal;
        float emitted = SIDES == 1u ? 1.0 : side == 0u ? emission.w : 1.0 - emission.w;
        if (SIDES == 6u) {
            if (areas[side >> 1] == 0.0) {
                store_side(index, side, vec3(0.0), face_weight(voxel, areas, opacity, side));
                continue;
            }
            own_normal = normal_of_face(voxel, side);
            emitted = dot(own_normal, front) >= 0.0 ? emission.w : 1.0 - emission.w;
        }
        vec3 direct =
            reflected(voxel, slot, own_normal, one_plane) + emission.rgb * emitted;
        vec3 bounced = indirect(voxel, slot);
        vec3 radiance = min(direct + bounced, vec3(LARGEST_HALF));
        if (SIDES == 6u) {
            mean_radiance += radiance * face_weight(voxel, areas, opacity, side & 6u);
            store_side(index, side, radiance, face_weight(voxel, areas, opacity, side));
            continue;
        }
        mean_radiance += min(direct, vec3(LARGEST_HALF));
        // Isotropic, it is what the front reflects, but the mean of opposed sides: as voxel.bounce
        // has it for a voxel of one radiance.
        mean_indirect += bounced
            * (SIDES == 1u              ? 1.0
                    : is_opposed(voxel) ? 0.5
                    : side == 0u        ? 1.0
                                        : 0.0);
        sides[side & 1u] = radiance;
#ifndef DENSE
        if (FACES != 0u) continue;
#endif
        // With the back goes what both sides together are multiplied by for a single radiance.
        vec2 seen = unpack_seen(voxel.coverage);
        store_side(index, side, radiance, side == 0u ? opacity : seen.x / seen.y);
    }
    uint faces = 0u;
    if (FACES != 0u) faces = 6u;
    for (uint face = 0u; face < faces; ++face) {
        vec4 seen = face_radiance(index, face, normal, sides);
#ifdef DENSE
        ivec3 cube = ivec3(int(face) * imageSize(dense_radiance).y, 0, 0);
        imageStore(dense_radiance, ivec3(voxel_coordinates(voxel.xy, voxel.z_area)) + cube,
            vec4(seen.rgb * seen.a, seen.a));
#else
        voxel_radiance[6u * index + face] = uvec2(packHalf2x16(seen.rg), packHalf2x16(seen.ba));
#endif
    }
#ifdef DENSE
    if (FACES != 0u) return;
    ivec3 texel = ivec3(voxel_coordinates(voxel.xy, voxel.z_area));
    if (NORMALS != 0u) {
        vec3 both = min(sides[0] + sides[1], vec3(LARGEST_HALF));
        imageStore(dense_radiance, texel, vec4(both * opacity, opacity));
        imageStore(dense_normals, texel,
            vec4(lit_normal(voxel, sides[0], sides[1]) * opacity, opacity));
        return;
    }
    vec2 seen = unpack_seen(voxel.coverage);
    if (SIDES == 2u) mean_radiance *= seen.x / seen.y;
    mean_radiance = min(mean_radiance + mean_indirect, vec3(LARGEST_HALF));
    imageStore(dense_radiance, texel, vec4(mean_radiance * opacity, opacity));
#endif
}
