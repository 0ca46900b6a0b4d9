// What a place on a path reflects of the light that probes have. The including pass declares how
// probes are looked up, and `params` with has_light.
#ifndef LUMIVOX_PROBES_BEYOND
#define LUMIVOX_PROBES_BEYOND

// Lobes reflect as if it came from all sides alike.
vec3 light_beyond(PathVertex v) {
    vec3 reflected = v.albedo + (v.roughness >= 0.0 ? v.f0 : vec3(0.0));
    if (params.has_light == 0u || reflected == vec3(0.0)) return vec3(0.0);
    return reflected / PI * light_of_probes(v.position, v.geometric_normal, v.normal).rgb;
}

#endif
