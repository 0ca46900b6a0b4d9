// Where the paths of a pixel begin.
#ifndef LUMIVOX_RAY_TRACED_START
#define LUMIVOX_RAY_TRACED_START

// The surface of a pixel as the first place of paths. Its position is that of the depth buffer,
// so rays start further off than from a hit: by `start_offset` times the largest coordinate and
// the distance of the eye.
PathVertex first_vertex(Surface surface, vec3 to_eye, vec3 albedo, vec3 f0, float roughness,
    float start_offset) {
    vec3 largest = max(abs(surface.position_ws), abs(frame.eye_ws.xyz - surface.position_ws));
    float offset = start_offset * max(largest.x, max(largest.y, largest.z));
    PathVertex v;
    v.position = surface.position_ws;
    v.origin = v.position + surface.geometric_normal * offset;
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
