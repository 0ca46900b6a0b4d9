// What probes see of what was drawn around them. The including pass declares RASTER_BINDING and
// RASTER_CONSTANT.
#ifndef LUMIVOX_PROBES_RASTER
#define LUMIVOX_PROBES_RASTER

#include "shared/frame.glsl"
#include "gi/probes/cube.glsl"

layout(constant_id = RASTER_CONSTANT) const uint RASTER_TEXELS = 32;   // edge of a face

// of each texel of each face: the triangle there
layout(set = 1, binding = RASTER_BINDING) uniform utexture2D probe_views;

const uint NOTHING_SEEN = 0xffffffffu;

// The texel of its face that shows a direction.
ivec2 raster_texel(uint face, vec3 direction) {
    vec3 local = to_face(face, direction);
    vec2 at = (local.xy / local.z * 0.5 + 0.5) * float(RASTER_TEXELS);
    return clamp(ivec2(at), ivec2(0), ivec2(RASTER_TEXELS - 1u));
}

// The middle of that texel: what is drawn there is what is met along it.
vec3 drawn_along(vec3 direction) {
    uint face = face_of(direction);
    vec2 at = (vec2(raster_texel(face, direction)) + 0.5) / float(RASTER_TEXELS);
    return from_face(face, vec3(2.0 * at - 1.0, 1.0));
}

struct RasterHit {
    uint triangle;    // NOTHING_SEEN: none
    vec2 at;          // where on it: shares of its second and third corner
    float distance;   // [m], infinite where there is none
};

// Along a direction from the place [m] of one of the probes that were drawn, by its number among
// them: what the texel there shows, where the direction meets its triangle or comes nearest to it.
RasterHit raster_along(uint probe, vec3 place, vec3 direction) {
    uint face = face_of(direction);
    ivec2 texel = raster_texel(face, direction);
    ivec2 size = textureSize(usampler2D(probe_views, nearest_clamp), 0);
    ivec2 tile = tile_of_face(probe, face, uint(size.x) / RASTER_TEXELS, RASTER_TEXELS);
    uint triangle = texelFetch(usampler2D(probe_views, nearest_clamp), tile + texel, 0).r;
    float far = uintBitsToFloat(0x7f800000u);
    if (triangle == NOTHING_SEEN) return RasterHit(NOTHING_SEEN, vec2(0.0), far);
    uvec3 v = vertices_of(triangle);
    vec3 a = position_of(v.x), first = position_of(v.y) - a, second = position_of(v.z) - a;
    // Möller & Trumbore 1997, without their bounds.
    vec3 across = cross(direction, second), from_a = place - a;
    float determinant = dot(first, across);
    vec3 up = cross(from_a, first);
    vec2 on = vec2(dot(from_a, across), dot(direction, up)) / determinant;
    float t = dot(second, up) / determinant;
    // A triangle that is seen from its edge: its middle.
    if (!(abs(determinant) > 0.0) || t <= 0.0) on = vec2(1.0 / 3.0);
    on = max(on, vec2(0.0));
    on /= max(on.x + on.y, 1.0);
    return RasterHit(triangle, on, distance(place, a + on.x * first + on.y * second));
}

#endif
