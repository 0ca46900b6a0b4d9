// What a place that a ray meets shows. The including pass follows paths, looks probes up, and
// declares REFLECTS_CONSTANT.
#ifndef LUMIVOX_PROBES_REFLECTED
#define LUMIVOX_PROBES_REFLECTED

// 1: places reflect the irradiance of probes, which is a bounce more
layout(constant_id = REFLECTS_CONSTANT) const uint REFLECTS = 0;

// What a place of a triangle emits, and reflects of the lights and of what probes have, back along
// `direction` [W/(m² sr)].
vec3 light_of_hit(uint triangle, vec2 at, vec3 direction) {
    PathVertex v = vertex_at(triangle, at, -direction);
    // What reflects the light of what emits is a bounce.
    vec3 light = v.emission + light_straight(v, frame.size_px.z, 0u, vec3(0.0));
    if (REFLECTS != 0u) {
        if (v.albedo != vec3(0.0))
            light += v.albedo / PI * light_of_probes(v.position, v.geometric_normal, v.normal).rgb;
    }
    return light;
}

#endif
