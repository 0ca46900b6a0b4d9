// Where the paths of a pixel begin.
#ifndef LUMIVOX_PATHS_START
#define LUMIVOX_PATHS_START

#include "render/bvh/start.glsl"

// The surface of a pixel as the first place of paths. Its position is that of the depth buffer,
// so rays start further off than from a hit.
PathVertex first_vertex(
    Surface surface, vec3 to_eye, vec3 albedo, vec3 f0, float roughness) {
    PathVertex v;
    v.position = surface.position_ws;
    v.origin = v.position + start_distance(v.position) * surface.geometric_normal;
    v.geometric_normal = surface.geometric_normal;
    v.normal = surface.shading_normal;
    v.to_viewer = to_eye;
    v.albedo = albedo;
    v.f0 = f0;
    v.roughness = roughness;
    v.emission = vec3(0.0);
    v.triangle = NO_TRIANGLE;
    return v;
}

#endif
