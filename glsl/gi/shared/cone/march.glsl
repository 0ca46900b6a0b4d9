// Cone marching through a prefiltered radiance volume (gi/shared/cone/volume.glsl).
#ifndef LUMIVOX_MARCH
#define LUMIVOX_MARCH

#include "shared/environment.glsl"
#include "gi/shared/cone/faces.glsl"
#include "gi/shared/cone/normals.glsl"
#include "gi/shared/cone/volume.glsl"

// With RECORD_SAMPLES the including pass has
//   void record_sample(vec3 position, float centre, float diameter, vec4 texel, float opacity)
// of every sample, in order; `opacity` that of its step.
struct ConeResult {
    vec3 radiance;           // [W/(m² sr)]
    float visibility;        // 1 − occlusion, weighted by distance
    float samples;           // taken or known to be empty
};

// Distance [voxels] at which a ray from `origin` inside the grid leaves it.
float exit_distance(vec3 origin, vec3 direction, float resolution) {
    vec3 safe = mix(direction, vec3(1e-20), equal(direction, vec3(0.0)));
    vec3 far = (mix(vec3(0.0), vec3(resolution), greaterThan(safe, vec3(0.0))) - origin) / safe;
    return min(far.x, min(far.y, far.z));
}

// Distance [voxels] at which the line of a ray enters the grid; negative behind its origin.
float entry_distance(vec3 origin, vec3 direction, float resolution) {
    vec3 safe = mix(direction, vec3(1e-20), equal(direction, vec3(0.0)));
    vec3 near = (mix(vec3(resolution), vec3(0.0), greaterThan(safe, vec3(0.0))) - origin) / safe;
    return max(near.x, max(near.y, near.z));
}

// A cone, as far as its steps depend on it alone.
struct Cone {
    float spread;            // 1 / (1 − β tan(γ/2))
    float widening;          // 2 tan(γ/2): diameter for each voxel of distance
    float least_width;       // of the height clamp at the apex [voxels]
    float width_rate;        // and for each voxel of distance
#ifdef END_PLANE
    // of the clamp at the plane that the cone ends at, at the apex [voxels]
    float end_width;
    float end_rate;          // and less for each voxel of distance
#endif
};

// The environment of a cone, by the tangent of its half angle.
vec3 environment_in_cone(vec3 direction, float tan_half) {
    return environment_around(direction, 2.0 * PI * (1.0 - inversesqrt(1.0 + tan_half * tan_half)));
}

// One step of a cone: where its sample is, how wide, and how long the step.
struct Step {
    float centre;            // distance of the sample [voxels]
    float diameter;          // of the sample [voxels]
    float stride;            // [voxels]
};

// The step that begins at distance t, where samples have at least a diameter `least`. It is centred
// on its sample, whose diameter belongs to the sample's own distance: d/2 β further on.
Step step_at(float t, Cone cone, float step_factor, float least) {
    float centre = max(t * cone.spread, t + 0.5 * step_factor * least);
    float widest = min(centre * cone.widening, cone.least_width + centre * cone.width_rate);
#ifdef END_PLANE
    widest = min(widest, cone.end_width - centre * cone.end_rate);
#endif
    float diameter = max(widest, least);
    float stride = step_factor * diameter;
    return Step(t + 0.5 * stride, diameter, stride);
}

// Opacity of a step of β d whose sample, at a distance [voxels], has the opacity α > 0.
float step_opacity(float alpha, float distance, MarchSettings m) {
    if (alpha > m.first_hit) return 1.0;
    float opacity = 1.0 - pow(max(1.0 - alpha, 0.0), m.opacity_exponent * m.step_factor);
    if (m.near_strength > 0.0)
        opacity *= smoothstep(0.0, 1.0, m.near_strength * sqrt(distance / m.max_distance));
    return opacity;
}

// One cone, front to back. At distance t its diameter is d = 2 t tan(γ/2) and it samples mip log2(d
// / voxel); a step of β d through texels of opacity α has opacity α' = 1 − (1 − α)^(g β). What is
// not covered at the end sees the environment. `origin` [voxels], `height` its height over the
// tangent plane [voxels], `cosine` between direction and the plane's normal. With END_PLANE samples
// are no wider than their height over a second plane / k either: `end_height` that of the apex
// [voxels], `end_cosine` between the direction and the way down to it.
ConeResult march_cone(
    vec3 origin, vec3 direction, float tan_half, float height, float cosine, MarchSettings m
#ifdef END_PLANE
    ,
    float end_height, float end_cosine
#endif
) {
    float end = min(exit_distance(origin, direction, m.resolution), m.max_distance);
    bool is_clamped = m.height_clamp > 0.0;
    float least_width = is_clamped ? height / m.height_clamp : 1e9,
          width_rate = is_clamped ? cosine / m.height_clamp : 0.0;
#ifdef END_PLANE
    float end_width = is_clamped ? end_height / m.height_clamp : 1e9,
          end_rate = is_clamped ? end_cosine / m.height_clamp : 0.0;
    Cone cone = Cone(1.0 / max(1.0 - m.step_factor * tan_half, 0.25), 2.0 * tan_half, least_width,
        width_rate, end_width, end_rate);
#else
    Cone cone = Cone(
        1.0 / max(1.0 - m.step_factor * tan_half, 0.25), 2.0 * tan_half, least_width, width_rate);
#endif
    set_view_lobe(tan_half);
    vec3 radiance = vec3(0.0);
    float through = 1.0, occlusion = 0.0, t = 0.0, samples = 0.0;
    while (t < end && through > m.early_stop) {
        Step at = step_at(t, cone, m.step_factor, least_diameter(origin + t * direction));
        // Samples of empty space add nothing. They have a loop of their own, so that lanes wait for
        // each other and then sample matter together.
        for (;;) {
            samples += 1.0;
            bool may_see =
                may_see_matter(origin + at.centre * direction, m.resolution, at.diameter);
            t += at.stride;
            bool is_last = t >= end;
            if (may_see || is_last) break;
#ifdef RECORD_SAMPLES
            record_sample(origin + at.centre * direction, at.centre, at.diameter, vec4(0.0), 0.0);
#endif
            at = step_at(t, cone, m.step_factor, least_diameter(origin + t * direction));
        }
        vec4 texel = sample_volume(
            origin + at.centre * direction, m.resolution, log2(at.diameter), direction);
#ifdef RECORD_SAMPLES
        record_sample(origin + at.centre * direction, at.centre, at.diameter, texel,
            texel.a > 0.0 ? step_opacity(texel.a, at.centre, m) : 0.0);
#endif
        if (texel.a > 0.0) {
            float opacity = step_opacity(texel.a, at.centre, m);
            radiance += through * opacity / texel.a * texel.rgb;
            float far = m.ao_falloff * at.centre + m.radius_falloff * 0.5 * at.diameter;
            occlusion += through * opacity / (1.0 + far * m.voxel_size_m);
            through *= 1.0 - opacity;
        }
    }
    radiance += through * environment_in_cone(direction, tan_half);
    return ConeResult(radiance, max(1.0 - occlusion, 0.0), samples);
}

#endif
