// Whether two pixels show one surface.
#ifndef LUMIVOX_ONE_SURFACE
#define LUMIVOX_ONE_SURFACE

#include "shared/frame.glsl"

// Height [m] of a pixel that shows this place.
float footprint_of(vec3 position) {
    return length(position - frame.eye_ws.xyz) * 2.0 * length(frame.ray_up.xyz)
        / float(frame.size_px.y);
}

// Off the plane by this many footprints at most, and with shading normals of this cosine at least.
struct Limits {
    float off_plane_m;
    float cosine;
};

bool is_one_surface(
    Limits limits, vec3 from_here, vec3 geometric_normal, vec3 shading_normal, vec3 other_normal) {
    return abs(dot(from_here, geometric_normal)) <= limits.off_plane_m
        && dot(shading_normal, other_normal) >= limits.cosine;
}

#endif
