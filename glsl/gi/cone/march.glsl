// Cone marching through a prefiltered radiance volume, dense or (SVO) sparse.
#ifndef LUMIVOX_MARCH
#define LUMIVOX_MARCH

#include "shared/frame.glsl"
#ifdef SVO
#include "gi/svo/sample.glsl"
#else
#include "gi/cone/dense.glsl"
#endif

// The including pass declares what the volume is sampled from, and has these parameters.
struct MarchSettings {
    float resolution;        // voxels along an edge of the grid
    float step_factor;       // β: step in sample diameters
    float opacity_exponent;  // g: 1 is the textbook; above it makes up for what trilinear sampling lets through
    float height_clamp;      // k: a sample's diameter is at most its height over the receiver's tangent plane / k; 0: off
    float max_distance;      // [voxels]
    float voxel_size_m;
    float ao_falloff;        // λ of the ambient visibility's 1 / (1 + λ r) [1/m]
};

struct ConeResult {
    vec3 radiance;           // [W/(m² sr)]
    float visibility;        // 1 − occlusion, weighted by distance
};

// Distance [voxels] at which a ray from `origin` inside the grid leaves it.
float exit_distance(vec3 origin, vec3 direction, float resolution) {
    vec3 safe = mix(direction, vec3(1e-20), equal(direction, vec3(0.0)));
    vec3 far = (mix(vec3(0.0), vec3(resolution), greaterThan(safe, vec3(0.0))) - origin) / safe;
    return min(far.x, min(far.y, far.z));
}

// One cone, front to back. At distance t its diameter is d = 2 t tan(γ/2) and it samples mip log2(d / voxel); a step of β d through texels of opacity α
// has opacity α' = 1 − (1 − α)^(g β). What is not covered at the end sees the environment.
// `origin` [voxels], `height` its height over the tangent plane [voxels], `cosine` between direction and the plane's normal.
ConeResult march_cone(vec3 origin, vec3 direction, float tan_half, float height, float cosine, MarchSettings m) {
    float end = min(exit_distance(origin, direction, m.resolution), m.max_distance);
    vec3 radiance = vec3(0.0);
    float through = 1.0, occlusion = 0.0, t = 0.0;
    while (t < end && through > 0.005) {
        // The step is centred on its sample, whose diameter belongs to the sample's own distance: d/2 β further on.
        float centre = max(t / max(1.0 - m.step_factor * tan_half, 0.25), t + 0.5 * m.step_factor);
        float diameter = 2.0 * centre * tan_half;
        if (m.height_clamp > 0.0) diameter = min(diameter, (height + centre * cosine) / m.height_clamp);
        diameter = max(diameter, 1.0);
        float stride = m.step_factor * diameter;
        centre = t + 0.5 * stride;
        vec4 texel = sample_volume(origin + centre * direction, m.resolution, log2(diameter));
        if (texel.a > 0.0) {
            float opacity = 1.0 - pow(max(1.0 - texel.a, 0.0), m.opacity_exponent * m.step_factor);
            radiance += through * opacity / texel.a * texel.rgb;
            occlusion += through * opacity / (1.0 + m.ao_falloff * centre * m.voxel_size_m);
            through *= 1.0 - opacity;
        }
        t += stride;
    }
    return ConeResult(radiance + through * frame.environment.rgb, 1.0 - occlusion);
}

#endif
