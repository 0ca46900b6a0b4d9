#version 460
#extension GL_GOOGLE_include_directive : require
// probes.explore: places on surfaces that light paths from the eye come to, each with the normal of
// the side that they come to. A thread a path.
layout(local_size_x = 64) in;

#include "render/bvh/bindings.glsl"

// xyz: place [m]; w: normal, octahedral; x is infinite where a path has ended
layout(std430, set = 1, binding = 5) restrict writeonly buffer SeenPlaces { uvec4 seen_places[]; };

layout(push_constant) uniform ExploreParams {
    vec4 eye;             // xyz [m]
    uint path_count;
    uint place_count;     // of a path
} params;

#include "render/bvh/traverse.glsl"
#include "shared/directions.glsl"
#include "shared/packing.glsl"
#include "shared/random.glsl"

// The golden angle, in turns of 2³²: whole numbers lose nothing after many rays.
const uint GOLDEN_TURN = 1640531527u;

// Ray `ray` of `count`: a point of a Fibonacci set.
vec3 fibonacci(uint ray, uint count) {
    float z = 1.0 - (2.0 * float(ray) + 1.0) / float(count);
    float phi = float(GOLDEN_TURN * ray) * 1.4629180792671596e-9;
    float r = sqrt(max(1.0 - z * z, 0.0));
    return vec3(r * cos(phi), r * sin(phi), z);
}

// How far off a surface a path goes on, as a share of the largest coordinate of its triangle.
const float OFFSET_SHARE = 2e-6;

void main() {
    uint path = gl_GlobalInvocationID.x + gl_WorkGroupID.y * (65535u * 64u);
    if (path >= params.path_count) return;
    vec3 origin = params.eye.xyz, direction = fibonacci(path, params.path_count);
    uint leaves = NO_TRIANGLE;
    bool has_ended = false;
    for (uint place = 0u; place < params.place_count; ++place) {
        uint slot = path * params.place_count + place;
        RayHit hit = RayHit(NO_TRIANGLE, 0.0, vec2(0.0));
        if (!has_ended) hit = closest_hit(origin, direction, leaves);
        if (hit.triangle == NO_TRIANGLE) {
            has_ended = true;
            seen_places[slot] = uvec4(0x7f800000u, 0u, 0u, 0u);
            continue;
        }
        uvec3 v = vertices_of(hit.triangle);
        vec3 a = position_of(v.x), b = position_of(v.y), c = position_of(v.z);
        vec3 normal = normalize(cross(b - a, c - a));
        if (dot(normal, direction) > 0.0) normal = -normal;
        vec3 at = a + hit.at.x * (b - a) + hit.at.y * (c - a);
        seen_places[slot] = uvec4(floatBitsToUint(at), pack_unit(normal));
        // Off the surface, since another may lie in its plane.
        vec3 largest = max(max(abs(a), abs(b)), abs(c));
        origin = at + normal * (OFFSET_SHARE * max(largest.x, max(largest.y, largest.z)));
        vec3 random = unit_numbers(pcg3(uvec3(path, place, 2u)));
        direction = hemisphere_direction(frame_around(normal), random.x, 2.0 * PI * random.y);
        leaves = hit.triangle;
    }
}
