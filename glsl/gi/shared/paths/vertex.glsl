// A place of a path on a surface: what it is made of, how it scatters, and how likely directions
// are to be drawn. Each as the reference has it.
#ifndef LUMIVOX_PATHS_VERTEX
#define LUMIVOX_PATHS_VERTEX

#include "render/bvh/traverse.glsl"
#include "shared/directions.glsl"
#include "shared/ggx.glsl"

// Rays start this far from a surface, in units of the largest coordinate of its triangle: 16 units
// in the last place.
const float OFFSET_RELATIVE = 16.0 * 1.1920929e-7;

struct PathVertex {
    vec3 origin;             // where rays start, on the viewer's side of the surface [m]
    vec3 geometric_normal;   // on the viewer's side
    vec3 normal;             // for shading, on the same side
    vec3 to_viewer;
    vec3 albedo;
    vec3 f0;
    float roughness;         // negative: no lobe
    vec3 emission;           // towards the viewer [W/(m² sr)]
    vec3 position;
    uint triangle;           // NO_TRIANGLE: not known
};

vec3 interpolated(vec3 a, vec3 b, vec3 c, vec2 at) {
    return a * (1.0 - at.x - at.y) + b * at.x + c * at.y;
}

// The normal of a material's map, around `normal`, which is returned where the texture coordinates
// are degenerate.
vec3 bent_normal(uint material, uvec3 v, vec2 uv, vec3 normal, vec3 edge_1, vec3 edge_2) {
    if (texture_rows[TEXTURES * material + NORMAL_TEXTURE].y == 0u) return normal;
    vec2 d1 = uvs[v.y] - uvs[v.x], d2 = uvs[v.z] - uvs[v.x];
    float determinant = d1.x * d2.y - d1.y * d2.x;
    vec3 along = (edge_1 * d2.y - edge_2 * d1.y) * sign(determinant);
    along -= normal * dot(along, normal);
    if (determinant == 0.0 || dot(along, along) == 0.0) return normal;
    vec3 tangent = normalize(along);
    float handedness = sign(determinant) * sign(dot(cross(edge_1, edge_2), normal));
    vec3 bitangent = cross(normal, tangent) * handedness;
    vec3 local = texture_at(material, NORMAL_TEXTURE, uv, false, vec4(0.0)).xyz * 2.0 - 1.0;
    vec3 bent = tangent * local.x + bitangent * local.y + normal * local.z;
    return dot(bent, bent) > 0.0 ? normalize(bent) : normal;
}

// The surface at a place of a triangle, seen from direction `to_viewer`.
PathVertex vertex_at(uint triangle, vec2 at, vec3 to_viewer) {
    uvec3 v = vertices_of(triangle);
    uint number = triangle_materials[triangle];
    Material material = materials[number];
    vec3 a = position_of(v.x), b = position_of(v.y), c = position_of(v.z);
    vec3 front = normalize(cross(b - a, c - a));
    bool is_front = dot(front, to_viewer) >= 0.0;
    vec2 uv = uv_on(triangle, at);
    vec3 shading = interpolated(
        shading_normal_of(v.x), shading_normal_of(v.y), shading_normal_of(v.z), at);
    shading = dot(shading, shading) > 0.0 ? normalize(shading) : front;
    if (dot(shading, front) < 0.0) shading = -shading;
    if (BUMPS != 0u) shading = bent_normal(number, v, uv, shading, b - a, c - a);
    PathVertex vertex;
    vertex.geometric_normal = is_front ? front : -front;
    vertex.normal = dot(shading, vertex.geometric_normal) >= 0.0 ? shading : -shading;
    vertex.to_viewer = to_viewer;
    vec3 base =
        material.albedo.rgb * texture_at(number, ALBEDO_TEXTURE, uv, true, vec4(1.0)).rgb;
    vec4 lobe = material.specular;
    if (LOBE_TEXTURES) lobe *= texture_at(number, LOBE_TEXTURE, uv, true, vec4(1.0));
    vertex.roughness = lobe.w;
    vertex.f0 = mix(lobe.rgb, base, material.metalness.x);
    vertex.albedo = base * (1.0 - material.metalness.x);
    vertex.emission = vec3(0.0);
    if (EMITTERS != 0u) {
        if (is_front && material.emission.rgb != vec3(0.0))
            vertex.emission = material.emission.rgb
                * texture_at(number, EMISSION_TEXTURE, uv, true, vec4(1.0)).rgb;
    }
    vec3 largest = max(max(abs(a), abs(b)), abs(c));
    vertex.position = interpolated(a, b, c, at);
    vertex.origin = vertex.position
        + vertex.geometric_normal
            * (OFFSET_RELATIVE * max(max(largest.x, largest.y), max(largest.z, 1e-30)));
    vertex.triangle = triangle;
    return vertex;
}

bool is_above(PathVertex v, vec3 direction) {
    return dot(v.normal, direction) > 0.0 && dot(v.geometric_normal, direction) > 0.0;
}

float lambda(float alpha, float cosine) {
    float tan2 = max(1.0 / (cosine * cosine) - 1.0, 0.0);
    return 0.5 * (sqrt(1.0 + alpha * alpha * tan2) - 1.0);
}

// f cos θ of the lobe [1/sr], and the density with which visible normals draw `wi` [1/sr].
vec4 lobe_towards(PathVertex v, vec3 wi) {
    float cos_o = dot(v.normal, v.to_viewer), cos_i = dot(v.normal, wi);
    if (cos_o <= 0.0 || cos_i <= 0.0) return vec4(0.0);
    float alpha = ggx_alpha(v.roughness), a2 = alpha * alpha;
    vec3 h = normalize(v.to_viewer + wi), across = cross(v.normal, h);
    float cos_h = dot(v.normal, h), d = cos_h * cos_h * a2 + dot(across, across);
    float distribution = a2 / (PI * d * d);
    float from = lambda(alpha, cos_o), to = lambda(alpha, cos_i);
    return vec4(schlick(v.f0, dot(wi, h)) * (distribution / ((1.0 + from + to) * 4.0 * cos_o)),
        distribution / ((1.0 + from) * 4.0 * cos_o));
}

// Share of directions that are drawn from the lobe.
float lobe_share(PathVertex v) {
    if (v.roughness < 0.0 || dot(v.normal, v.to_viewer) <= 0.0) return 0.0;
    const vec3 weights = vec3(0.2126, 0.7152, 0.0722);
    float diffuse = dot(v.albedo, weights), specular = max(dot(v.f0, weights), 0.04);
    return clamp(specular / (diffuse + specular), 0.1, 1.0);
}

// f cos θ [1/sr] of light from `wi`, 0 below the surface, and the density of drawing it [1/sr].
vec4 reflected_towards(PathVertex v, vec3 wi) {
    float cosine = max(dot(v.normal, wi), 0.0) / PI;
    vec4 diffuse = vec4(v.albedo * cosine, cosine);
    vec4 all = diffuse;
    if (v.roughness >= 0.0) {
        vec4 lobe = lobe_towards(v, wi);
        all = vec4(diffuse.rgb + lobe.rgb, mix(cosine, lobe.a, lobe_share(v)));
    }
    return is_above(v, wi) ? all : vec4(0.0, 0.0, 0.0, all.a);
}

// A direction of the lobe (Heitz 2018; Dupuy & Benyoub 2023).
vec3 lobe_direction(PathVertex v, vec2 random) {
    mat3 around = frame_around(v.normal);
    vec3 wo = v.to_viewer * around;
    return around * reflect(-wo, visible_half_vector(wo, ggx_alpha(v.roughness), random));
}

// A direction from all that the surface scatters.
vec3 scattered(PathVertex v, vec3 random) {
    if (random.x < lobe_share(v)) return lobe_direction(v, random.yz);
    return hemisphere_direction(frame_around(v.normal), random.y, 2.0 * PI * random.z);
}

#endif
