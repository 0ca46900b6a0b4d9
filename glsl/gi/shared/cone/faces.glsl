// Texels of six faces: what is seen of a texel along each axis from either side. A cone meets three
// of them, those that look back at it.
#ifndef LUMIVOX_FACES
#define LUMIVOX_FACES

// Whether levels have six faces, and whether the finest has.
layout(constant_id = 3) const bool FACES = false;
layout(constant_id = 4) const bool FINEST_FACES = false;
// Whether the opacities of three faces combine by their extinction along the direction, or with the
// squares of its components as weights.
layout(constant_id = 5) const bool EXTINCTION = true;

// 1 − α that opaque matter counts with: its extinction would be infinite.
const float OPAQUE = 1.52587890625e-5;   // 2⁻¹⁶

// With FACES.
bool has_faces(int level) {
    return FINEST_FACES || level > 0;
}

// The faces that a ray in this direction meets, one an axis: of +x, −x, +y, −y, +z, −z by number.
ivec3 faces_met(vec3 direction) {
    return ivec3(0, 2, 4) + ivec3(greaterThan(direction, vec3(0.0)));
}

// τ = Σ |ω_k| τ_k with τ_k = −ln(1 − α_k), radiance the mean weighted with |ω_k| τ_k; `along`: |ω|.
vec4 combine_extinctions(vec4 x, vec4 y, vec4 z, vec3 along) {
    vec3 opacity = vec3(x.a, y.a, z.a);
    // τ_k/α_k, and α/τ below, by their series where the quotient would cancel.
    vec3 rate = mix(-log(max(1.0 - opacity, OPAQUE)) / max(opacity, 1e-6), 1.0 + 0.5 * opacity,
        lessThan(opacity, vec3(1e-3)));
    vec3 share = along * rate;
    float depth = dot(share, opacity);
    float covered = depth < 1e-3 ? 1.0 - 0.5 * depth : (1.0 - exp(-depth)) / depth;
    return covered * (share.x * x + share.y * y + share.z * z);
}

// The three faces that a ray in a unit direction meets, radiance premultiplied by opacity, as one
// texel.
vec4 combine_faces(vec4 x, vec4 y, vec4 z, vec3 direction) {
    if (EXTINCTION) return combine_extinctions(x, y, z, abs(direction));
    return direction.x * direction.x * x + direction.y * direction.y * y
        + direction.z * direction.z * z;
}

#endif
