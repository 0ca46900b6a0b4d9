// The way of a pixel's ray through what is clear: straight through thin sheets, mirrored or
// refracted by the surfaces of bodies. The including pass binds what render/bvh/bindings.glsl
// declares, of the clear surfaces alone, and defines FIRST_BINDING, the first of its own, and
// ASKED: `writeonly` where it does not read what it asked.
#ifndef LUMIVOX_CLEAR_WAY
#define LUMIVOX_CLEAR_WAY

#include "shared/sight.glsl"

// What passes a material of the clear surfaces.
struct Clear {
    vec4 passes;   // rgb: share of light that passes one of its surfaces; w: index of refraction
};

// Where a line of sight goes on when nothing hides its end.
struct Way {
    vec4 left;     // rgb: what is left of the light; w: bits of the next triangle, or NO_TRIANGLE
    vec4 at;       // xy: barycentric coordinates there
};

layout(std430, set = 1, binding = FIRST_BINDING) restrict readonly buffer ClearMaterials {
    Clear clear_materials[];
};
layout(std430, set = 1, binding = FIRST_BINDING + 1) restrict ASKED buffer Ways { Way ways[]; };
layout(std430, set = 1, binding = FIRST_BINDING + 2) restrict ASKED buffer SightRays {
    SightRay sight_rays[];
};

#include "render/bvh/traverse.glsl"

// As in the reference: 16 units in the last place.
const float OFFSET_RELATIVE = 16.0 * 1.1920929e-7;
// Less than this is as good as nothing.
const float LEAST_LEFT = 1e-4;

float infinite() { return uintBitsToFloat(0x7f800000u); }

// A place on a clear surface, seen along a ray.
struct Interface {
    vec3 position;
    vec3 geometric_normal;   // on the viewer's side
    vec3 normal;             // for shading, on the same side
    float offset;            // of rays from the place [m]
    vec3 passes;
    bool is_thin;
    float eta;               // index on the viewer's side over that on the other
};

Interface interface_at(uint triangle, vec2 at, vec3 direction) {
    uvec3 v = vertices_of(triangle);
    vec3 a = position_of(v.x), b = position_of(v.y), c = position_of(v.z);
    float first = 1.0 - at.x - at.y;
    vec3 front = normalize(cross(b - a, c - a));
    vec3 shading = first * shading_normal_of(v.x) + at.x * shading_normal_of(v.y)
        + at.y * shading_normal_of(v.z);
    shading = dot(shading, shading) > 0.0 ? normalize(shading) : front;
    bool is_front = dot(front, direction) <= 0.0;
    Interface met;
    met.position = first * a + at.x * b + at.y * c;
    met.geometric_normal = is_front ? front : -front;
    met.normal = dot(shading, met.geometric_normal) >= 0.0 ? shading : -shading;
    vec3 largest = max(max(abs(a), abs(b)), abs(c));
    met.offset = OFFSET_RELATIVE * max(max(largest.x, largest.y), max(largest.z, 1e-30));
    vec4 passes = clear_materials[triangle_materials[triangle]].passes;
    met.passes = passes.rgb;
    met.is_thin = passes.w == 1.0;
    met.eta = is_front ? 1.0 / passes.w : passes.w;
    return met;
}

// A ray that goes on from a surface, and what is left of the light along it.
struct Passed {
    vec3 origin;
    vec3 direction;
    vec3 left;
};

Passed leave(Interface met, vec3 direction, bool is_through, vec3 left) {
    float side = is_through ? -1.0 : 1.0;
    return Passed(
        met.position + side * met.offset * met.geometric_normal, normalize(direction), left);
}

// Light that the surface of a body mirrors (`is_mirrored`), or what it refracts; where it cannot
// refract, all is mirrored (Born & Wolf, section 1.5).
Passed meet_body(Interface met, vec3 direction, bool is_mirrored, vec3 left) {
    float cosine = clamp(-dot(met.normal, direction), 0.0, 1.0);
    vec3 mirrored = direction + 2.0 * cosine * met.normal;
    float squared = 1.0 - met.eta * met.eta * (1.0 - cosine * cosine);
    if (squared <= 0.0) return leave(met, mirrored, false, left);
    float refracted = sqrt(squared);
    float across = (met.eta * cosine - refracted) / (met.eta * cosine + refracted);
    float within = (cosine - met.eta * refracted) / (cosine + met.eta * refracted);
    float reflectance = 0.5 * (across * across + within * within);
    if (is_mirrored) return leave(met, mirrored, false, reflectance * left);
    vec3 bent = met.eta * direction + (met.eta * cosine - refracted) * met.normal;
    return leave(met, bent, true, (1.0 - reflectance) * met.passes * left);
}

// Asks what is seen along a ray up to the next clear surface.
void aim(uint index, Passed passed, uint leaves) {
    RayHit hit = traverse(passed.origin, passed.direction, infinite(), leaves, NO_TRIANGLE, false);
    ways[index] = Way(vec4(passed.left, uintBitsToFloat(hit.triangle)), vec4(hit.at, 0.0, 0.0));
    sight_rays[index] =
        SightRay(vec4(passed.origin, hit.t), vec4(passed.direction, 0.0));
}

#endif
