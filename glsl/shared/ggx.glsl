// The glossy lobe: GGX (Walter et al. 2007) with height-correlated Smith shadowing (Heitz 2014) and
// Schlick's Fresnel; α = roughness².
#ifndef LUMIVOX_GGX
#define LUMIVOX_GGX

float ggx_alpha(float roughness) {
    return max(roughness * roughness, 1e-3);
}

vec3 schlick(vec3 f0, float cosine) {
    float m = clamp(1.0 - cosine, 0.0, 1.0);
    return f0 + (1.0 - f0) * (m * m * m * m * m);
}

// f_s [1/sr]; 0 where the eye or the light is below the surface.
vec3 ggx_brdf(vec3 n, vec3 wo, vec3 wi, vec3 f0, float roughness) {
    if (dot(n, wo) <= 0.0 || dot(n, wi) <= 0.0) return vec3(0.0);
    vec3 h = normalize(wo + wi), across = cross(n, h);
    float a2 = ggx_alpha(roughness) * ggx_alpha(roughness);
    float nh = dot(n, h), no = max(dot(n, wo), 1e-4), ni = max(dot(n, wi), 1e-4);
    // The sine by the cross product: as 1 - cos², single precision loses the peak of a narrow lobe.
    float d = nh * nh * a2 + dot(across, across);
    float distribution = a2 / (3.14159265358979 * d * d);
    float visibility =
        0.5 / (ni * sqrt(no * no * (1.0 - a2) + a2) + no * sqrt(ni * ni * (1.0 - a2) + a2));
    return schlick(f0, dot(wi, h)) * (distribution * visibility);
}

// Directional albedo of the lobe: the fit of Karis 2014 ("Physically Based Shading on Mobile").
vec3 ggx_albedo(vec3 f0, float roughness, float cosine) {
    vec4 r = roughness * vec4(-1.0, -0.0275, -0.572, 0.022) + vec4(1.0, 0.0425, 1.04, -0.04);
    float a004 = min(r.x * r.x, exp2(-9.28 * cosine)) * r.x + r.y;
    vec2 ab = vec2(-1.04, 1.04) * a004 + r.zw;
    return max(f0 * ab.x + ab.y, vec3(0.0));
}

// A half vector around +z that an eye in direction `wo` sees, distributed as the facets that it
// sees are, for two numbers of [0, 1) (Dupuy & Benyoub 2023).
vec3 visible_half_vector(vec3 wo, float alpha, vec2 uv) {
    vec3 stretched = normalize(vec3(alpha * wo.xy, wo.z));
    float z = (1.0 - uv.x) * (1.0 + stretched.z) - stretched.z;
    float across = sqrt(clamp(1.0 - z * z, 0.0, 1.0)), phi = 6.28318530717959 * uv.y;
    vec3 cap = vec3(across * cos(phi), across * sin(phi), z) + stretched;
    return normalize(vec3(alpha * cap.xy, max(cap.z, 1e-6)));
}

// Share of those facets' light in direction `wi` that no other facet stops: G₂ / G₁(wo), both
// directions around +z (Heitz 2014).
float unmasked_share(vec3 wo, vec3 wi, float alpha) {
    vec2 cosines = vec2(wo.z, wi.z), tan2 = 1.0 / (cosines * cosines) - 1.0;
    vec2 masked = 0.5 * (sqrt(1.0 + alpha * alpha * tan2) - 1.0);
    return (1.0 + masked.x) / (1.0 + masked.x + masked.y);
}

#endif
