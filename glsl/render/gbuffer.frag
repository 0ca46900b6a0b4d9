#version 460
#extension GL_GOOGLE_include_directive : require
// render.gbuffer: view depth, normals on the viewer's side, diffuse albedo, and where the scene has them the specular lobe and emission.
#include "shared/frame.glsl"
#include "shared/material.glsl"
#include "shared/packing.glsl"

layout(constant_id = 0) const uint GLOSSY = 0;
layout(constant_id = 1) const uint EMISSIVE = 0;

layout(location = 0) in vec3 position_ws;
layout(location = 1) in vec3 normal_ws;
layout(location = 2) in vec2 uv;
layout(location = 3) flat in uint triangle_index;

layout(location = 0) out float view_depth_m;
layout(location = 1) out uvec2 normals;        // x: geometric, y: shading; octahedral
layout(location = 2) out vec4 albedo;          // rgb: diffuse albedo; a: roughness
layout(location = 3) out vec4 specular;        // rgb: F0
layout(location = 4) out vec4 emission;        // rgb: radiance [W/(m² sr)]

// Shading normal from a tangent-space map, with the tangent frame of the triangle's texture coordinates.
vec3 mapped_normal(uvec4 triangle, vec3 normal) {
    Vertex a = vertices[triangle.x], b = vertices[triangle.y], c = vertices[triangle.z];
    vec3 e1 = b.position_u.xyz - a.position_u.xyz, e2 = c.position_u.xyz - a.position_u.xyz;
    vec2 d1 = vec2(b.position_u.w, b.normal_v.w) - vec2(a.position_u.w, a.normal_v.w);
    vec2 d2 = vec2(c.position_u.w, c.normal_v.w) - vec2(a.position_u.w, a.normal_v.w);
    float determinant = d1.x * d2.y - d2.x * d1.y;
    if (abs(determinant) < 1e-20) return normal;
    vec3 tangent = (e1 * d2.y - e2 * d1.y) / determinant;
    tangent = tangent - normal * dot(normal, tangent);
    if (dot(tangent, tangent) < 1e-20) return normal;
    tangent = normalize(tangent);
    vec3 bitangent = cross(normal, tangent) * sign(determinant);
    vec3 local = texture(sampler2D(normal_texture, linear_repeat), uv).xyz * 2.0 - 1.0;
    return normalize(local.x * tangent + local.y * bitangent + local.z * normal);
}

void main() {
    uvec4 triangle = triangles[triangle_index];
    Material m = materials[triangle.w];
    if (m.albedo.w > 0.0 && texture(sampler2D(mask_texture, linear_repeat), uv).r < 0.5) discard;
    vec3 base = m.albedo.rgb * texture(sampler2D(albedo_texture, linear_repeat), uv).rgb;
    vec3 a = vertices[triangle.x].position_u.xyz, b = vertices[triangle.y].position_u.xyz, c = vertices[triangle.z].position_u.xyz;
    vec3 geometric = normalize(cross(b - a, c - a));
    vec3 shading = normalize(normal_ws);
    shading = dot(shading, geometric) < 0.0 ? -shading : shading;
    if (m.emission.w > 0.0) shading = mapped_normal(triangle, shading);
    vec3 to_eye = frame.eye_ws.xyz - position_ws;
    bool front = dot(geometric, to_eye) >= 0.0;
    view_depth_m = -dot(to_eye, frame.ray_forward.xyz);
    normals = front ? uvec2(pack_unit(geometric), pack_unit(shading)) : uvec2(pack_unit(-geometric), pack_unit(-shading));
    float metalness = m.metalness.x;
    albedo = vec4(GLOSSY != 0u ? base * (1.0 - metalness) : base, m.specular.w);
    if (GLOSSY != 0u) specular = vec4(m.specular.w < 0.0 ? vec3(0.0) : mix(m.specular.rgb, base, metalness), 0.0);
    if (EMISSIVE != 0u) emission = vec4(front ? m.emission.rgb * texture(sampler2D(emission_texture, linear_repeat), uv).rgb : vec3(0.0), 0.0);
}
