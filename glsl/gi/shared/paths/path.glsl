// Paths of light, backwards (Kajiya 1986): at each place the lights by shadow rays or maps,
// emissive triangles by aiming at one and by scattering, weighted by the power heuristic (Veach
// 1997), the environment by scattering: the mean around a ray, over its share of all directions.
#ifndef LUMIVOX_PATHS_PATH
#define LUMIVOX_PATHS_PATH

#include "gi/shared/paths/vertex.glsl"
#include "shared/environment.glsl"
#include "shared/random.glsl"
#include "shared/visibility.glsl"
#ifdef CACHED
#include "gi/shared/paths/cache.glsl"
#endif
#ifdef BEYOND
// What the last place of a path reflects of the light that is there after more bounces.
vec3 light_beyond(PathVertex v);
#endif

float power_heuristic(float own, float other) {
    float ratio = other / own;
    return 1.0 / (1.0 + ratio * ratio);
}

// Density [1/sr] with which a point of what emits is drawn from `origin`.
float emitter_density(vec3 origin, PathVertex emitter) {
    vec3 offset = origin - emitter.position;
    float cosine = dot(emitter.geometric_normal, emitter.to_viewer);
    float per_area = emitter_densities[triangle_materials[emitter.triangle]];
    return cosine > 0.0 ? per_area * dot(offset, offset) / cosine : 0.0;
}

// A ray that has to be free for light to come along it.
struct ShadowRay {
    vec3 light;       // that comes then [W/(m² sr)]
    vec3 direction;
    float distance;
    uint target;      // the triangle that it aims at
};

// Of an analytic light.
ShadowRay ray_to_light(PathVertex v, Light light) {
    vec3 to_light;
    vec3 irradiance = light_irradiance(light, v.origin, to_light);
    float distance = light.position_kind.w == LIGHT_DIRECTIONAL
        ? uintBitsToFloat(0x7f800000u)
        : length(light.position_kind.xyz - v.origin);
    vec3 reflected = reflected_towards(v, to_light).rgb * irradiance;
    return ShadowRay(reflected, to_light, distance, NO_TRIANGLE);
}

// Of a point of what emits, drawn by its power.
ShadowRay ray_to_emitter(PathVertex v, vec3 random) {
    ShadowRay none = ShadowRay(vec3(0.0), vec3(0.0), 0.0, NO_TRIANGLE);
    float place = random.x * float(EMITTERS);
    uint row = min(uint(place), EMITTERS - 1u);
    bool is_own = place - float(row) < emitters[row].own_share;
    uint triangle = is_own ? emitters[row].own : emitters[row].other;
    float root = sqrt(random.y);
    vec2 at = vec2(root * (1.0 - random.z), root * random.z);
    uvec3 corners = vertices_of(triangle);
    vec3 way = interpolated(position_of(corners.x), position_of(corners.y),
                   position_of(corners.z), at)
        - v.origin;
    float distance = length(way);
    vec3 direction = way / distance;
    if (!(distance > 0.0) || triangle == v.triangle || !is_above(v, direction)) return none;
    PathVertex emitter = vertex_at(triangle, at, -direction);
    float density = emitter_density(v.origin, emitter);
    if (density <= 0.0 || emitter.emission == vec3(0.0)) return none;
    if (BVH_MASKS != 0u) {
        if (!is_solid(triangle, at)) return none;
    }
    vec4 reflected = reflected_towards(v, direction);
    float weight = power_heuristic(density, reflected.a) / density;
    return ShadowRay(reflected.rgb * emitter.emission * weight, direction, distance, triangle);
}

// What of a light reaches a place, by its maps.
float mapped_visibility(PathVertex v, Light light) {
    return light_visibility(light, v.position, v.geometric_normal, 0.0, true);
}

// What reaches a place straight from `light_count` lights and, where `emitter_count` is 1, from
// what emits, reflected there.
vec3 light_straight(PathVertex v, uint light_count, uint emitter_count, vec3 random) {
    vec3 radiance = vec3(0.0);
    for (uint i = 0u; i < light_count + emitter_count; ++i) {
        bool is_light = i < light_count;
        ShadowRay ray;
        if (is_light) {
            ray = ray_to_light(v, lights[i]);
        } else {
            ray = ray_to_emitter(v, random);
        }
        if (ray.light == vec3(0.0)) continue;
        if (SHADOW_MAPS != 0u) {
            if (is_light) {
                radiance += ray.light * mapped_visibility(v, lights[i]);
                continue;
            }
        }
        if (!is_occluded(v.origin, ray.direction, ray.distance, v.triangle, ray.target))
            radiance += ray.light;
    }
    return radiance;
}

// Three numbers of [0, 1) for the n-th path of a pixel. At its first place (0) they are those of
// the R3 sequence (Roberts 2018), from a start of the pixel's own; later ones are independent.
vec3 numbers_for(ivec2 pixel, uint n, uint place, uint purpose) {
    uint of_place = place == 0u ? 0u : n + 1u;
    uvec3 key = uvec3(uint(pixel.x) | uint(pixel.y) << 16, of_place, 2u * place + purpose);
    uvec3 start = pcg3(key);
    if (place == 0u) start += n * uvec3(0xd1b54a33u, 0xabc98388u, 0x8cb92ba7u);
    return unit_numbers(start);
}

// What a path brings to a place, reflected there: emission, then what is reflected up to `bounces`
// times from the pixel's surface on, which is place 0. `which` is its number and how many a pixel
// has. Place 0 draws `first` in place of a direction of its own; `escaped` is whether that met
// nothing. Lobes of later places are at least `least_roughness` wide (Kaplanyan & Dachsbacher
// 2013).
vec3 light_from(PathVertex v, uint first_place, vec3 first, ivec2 pixel, uvec2 which, uint bounces,
    float least_roughness, out bool escaped) {
    uint n = which.x;
    vec3 throughput = vec3(1.0), radiance = vec3(0.0);
    escaped = false;
    for (uint place = first_place; place <= bounces; ++place) {
        bool is_last = place == bounces;
#ifdef CACHED
        if (is_last) {
            radiance += throughput * cached_light(v);
            break;
        }
#endif
        uint emitter_count = is_last ? 0u : min(EMITTERS, 1u);
        radiance += throughput
            * light_straight(v, place == 0u ? 0u : frame.size_px.z, emitter_count,
                numbers_for(pixel, n, place, 0u));
#ifdef BEYOND
        if (is_last) radiance += throughput * light_beyond(v);
#endif
        if (is_last) break;
        vec3 direction = place == 0u ? first : scattered(v, numbers_for(pixel, n, place, 1u));
        vec4 reflected = reflected_towards(v, direction);
        if (reflected.rgb == vec3(0.0) || !(reflected.a > 0.0)) break;
        throughput *= reflected.rgb / reflected.a;
        RayHit hit = closest_hit(v.origin, direction, v.triangle);
        if (hit.triangle == NO_TRIANGLE) {
            escaped = place == 0u;
            radiance += throughput
                * environment_of_scattered(direction, reflected.a, which.y);
            break;
        }
        vec3 origin = v.origin;
        v = vertex_at(hit.triangle, hit.at, -direction);
        if (v.roughness >= 0.0) v.roughness = max(v.roughness, least_roughness);
        if (EMITTERS != 0u) {
            if (v.emission != vec3(0.0))
                radiance += throughput * v.emission
                    * power_heuristic(reflected.a, emitter_density(origin, v));
        }
    }
    return radiance;
}

// The same to the pixel's surface.
vec3 light_along(PathVertex v, vec3 first, ivec2 pixel, uvec2 which, uint bounces,
    float least_roughness, out bool escaped) {
    return light_from(v, 0u, first, pixel, which, bounces, least_roughness, escaped);
}

#endif
