// Light on points of a voxel's surface, by rays against the scene's triangles: no map, and no
// sums that threads share. voxel.light includes it.
#ifndef LUMIVOX_LIT_POINTS
#define LUMIVOX_LIT_POINTS

#include "render/bvh/traverse.glsl"

// Rays start this far off the surface, and look this far beyond the voxel's faces, on which a
// surface may lie by rounding [voxels].
const float POINT_OFFSET = 1e-3, BEYOND = 0.01;

// ρ/π E of each radiance of the voxel: of its one, its sides or its faces.
vec3 of_points[6];

// The surface that a light meets first in a voxel, along one ray.
struct LitPoint {
    vec3 position;
    vec3 normal;      // on the light's side
    uint triangle;    // NO_TRIANGLE: the ray meets nothing in the voxel
    vec2 at;
};

// Point number `i`: rays come in through the voxel's faces that look to the light, as many through
// each as the light sees of it. `corner` is the voxel's smallest [m], `to_light` the direction
// from its middle.
LitPoint point_met(uint i, vec3 start, vec3 corner, vec3 to_light, Light light) {
    // The R3 sequence (Roberts 2018).
    vec3 random = fract(start + float(i) * vec3(0.8191725133961645, 0.6710436067037893,
        0.5497004779019703));
    vec3 seen = abs(to_light);
    float pick = random.x * (seen.x + seen.y + seen.z);
    uint axis = pick < seen.x ? 0u : pick < seen.x + seen.y ? 1u : 2u;
    vec3 entry = axis == 0u ? vec3(0.0, random.yz)
        : axis == 1u        ? vec3(random.z, 0.0, random.y)
                            : vec3(random.yz, 0.0);
    entry[axis] = to_light[axis] > 0.0 ? 1.0 : 0.0;
    float size = params.grid.w;
    vec3 from = corner + size * entry, towards = to_light;
    if (light.position_kind.w != LIGHT_DIRECTIONAL)
        towards = normalize(light.position_kind.xyz - from);
    vec3 ways = mix(1.0 - entry, entry, greaterThan(towards, vec3(0.0)))
        / max(abs(towards), vec3(1e-6));
    float chord = min(ways.x, min(ways.y, ways.z));
    from += BEYOND * size * towards;
    RayHit hit = traverse(from, -towards, (chord + 2.0 * BEYOND) * size, NO_TRIANGLE, NO_TRIANGLE,
        false);
    LitPoint point = LitPoint(from - hit.t * towards, towards, hit.triangle, hit.at);
    if (hit.triangle != NO_TRIANGLE) {
        uvec3 v = vertices_of(hit.triangle);
        vec3 a = position_of(v.x);
        point.normal = normalize(cross(position_of(v.y) - a, position_of(v.z) - a));
        if (dot(point.normal, towards) < 0.0) point.normal = -point.normal;
    }
    return point;
}

// What of a light reaches a point of a surface on its side.
bool is_reached(Light light, vec3 position, vec3 normal, vec3 to_light, uint triangle) {
    float distance = light.position_kind.w == LIGHT_DIRECTIONAL
        ? uintBitsToFloat(0x7f800000u)
        : length(light.position_kind.xyz - position);
    vec3 origin = position + POINT_OFFSET * params.grid.w * normal;
    return !is_occluded(origin, to_light, distance, triangle, NO_TRIANGLE);
}

vec3 albedo_at(LitPoint point) {
    uint number = triangle_materials[point.triangle];
    Material material = materials[number];
    return material.albedo.rgb * (1.0 - material.metalness.x)
        * texture_at(
            number, ALBEDO_TEXTURE, uv_on(point.triangle, point.at), true, vec4(1.0)).rgb;
}

// How much of a surface counts for a radiance of the voxel: `normal` is on the lit side, `front`
// parts the voxel's sides.
float share_of(uint side, vec3 normal, vec3 front) {
    if (SIDES == 1u) return 1.0;
    if (SIDES == 2u) return (side == 0u) == (dot(normal, front) >= 0.0) ? 1.0 : 0.0;
    float towards = (side & 1u) == 0u ? normal[side >> 1] : -normal[side >> 1];
    return max(towards, 0.0);
}

// Normal of the surface that a radiance of a voxel of one plane is of.
vec3 normal_of_side(Voxel voxel, uint side, vec3 front) {
    if (SIDES == 6u) return normal_of_face(voxel, side);
    return side == 0u ? front : -front;
}

// Fills `of_points`. The points of one plane say which share of it is lit, those of several also
// how much of each the light sees.
void light_points(Voxel voxel, vec3 front, bool one_plane) {
    float size = params.grid.w;
    uvec3 place = uvec3(voxel_coordinates(voxel.xy, voxel.z_area));
    vec3 corner = params.grid.xyz + size * (vec3(place) + vec3(params.first.xyz));
    vec3 position = corner + size * unpack_unorm10(voxel.mean_position);
    uint seed = seed_of(place, 0u);
    vec3 start = vec3(seed & 1023u, seed >> 10 & 1023u, seed >> 20 & 1023u) / 1024.0;
    for (uint side = 0u; side < 6u; ++side) of_points[side] = vec3(0.0);
    for (uint i = 0u; i < frame.size_px.z; ++i) {
        Light light = lights[i];
        vec3 to_light;
        vec3 arriving = light_irradiance(light, position, to_light);
        if (arriving == vec3(0.0)) continue;
        float whole = abs(to_light.x) + abs(to_light.y) + abs(to_light.z);   // [voxel faces]
        float met = 0.0, lit = 0.0, seen[6];
        vec3 sums[6];
        for (uint side = 0u; side < SIDES; ++side) {
            seen[side] = 0.0;
            sums[side] = vec3(0.0);
        }
        for (uint n = 0u; n < POINTS; ++n) {
            LitPoint point = point_met(n, start, corner, to_light, light);
            if (point.triangle == NO_TRIANGLE) continue;
            met += 1.0;
            vec3 towards;
            vec3 irradiance = light_irradiance(light, point.position, towards);
            if (!is_reached(light, point.position, point.normal, towards, point.triangle)) continue;
            lit += 1.0;
            if (one_plane) continue;
            irradiance *= albedo_at(point) / PI;
            for (uint side = 0u; side < SIDES; ++side) {
                float share = share_of(side, point.normal, front);
                sums[side] += share * irradiance;
                seen[side] += share;
            }
        }
        // Rounding may have put all of a sliver's surface outside.
        bool is_missed = met == 0.0;
        if (is_missed) {
            bool is_behind = dot(front, to_light) < 0.0;
            met = 1.0;
            lit = float(
                is_reached(light, position, is_behind ? -front : front, to_light, NO_TRIANGLE));
        }
        for (uint side = 0u; side < SIDES; ++side) {
            if (one_plane || is_missed) {
                vec3 normal = normal_of_side(voxel, side, front);
                of_points[side] += unpack_albedo(voxel.albedo) / PI * arriving * lit / met
                    * attenuation(voxel, normal, to_light);
                continue;
            }
            // A surface is never seen larger than it is.
            float each = whole / float(POINTS), area = area_of(voxel, side);
            of_points[side] += sums[side] * each / max(max(area, seen[side] * each), 1e-6);
        }
    }
}

#endif
