#version 460
#extension GL_GOOGLE_include_directive : require
// render.gbuffer: view depth, normals on the viewer's side, diffuse albedo, where the scene has
// them the specular lobe and emission, and where they are asked for motion and the material.
#include "shared/frame.glsl"
#include "shared/material.glsl"
#include "shared/packing.glsl"

// Whether some material of the scene has a mask, any other texture but bumps, and bumps.
layout(constant_id = 0) const bool MASKED = true;
layout(constant_id = 1) const bool TEXTURED = true;
layout(constant_id = 2) const bool BUMPED = true;

layout(location = 0) in vec3 position_ws;
layout(location = 1) in vec3 normal_ws;
layout(location = 2) in vec2 uv;
layout(location = 3) flat in uint triangle_index;

layout(location = 0) out float view_depth_m;
layout(location = 1) out uvec2 normals;        // x: geometric, y: shading; octahedral
layout(location = 2) out vec4 albedo;          // rgb: diffuse albedo; a: length of the mean normal
#ifdef GLOSSY
layout(location = 3) out vec4 specular;        // rgb: F0; a: roughness, −1 where there is no lobe
#endif
#ifdef EMISSIVE
layout(location = EMISSIVE) out vec4 emission; // rgb: radiance [W/(m² sr)]
#endif
#ifdef MOTION
layout(location = 4) in vec4 clip;
layout(location = 5) in vec4 previous_clip;
// xy: place in the frame before less that in this [px]; z: view depth there [m]; w: of what has
// moved, the shading normal there (shared/turned.glsl), 0 elsewhere
layout(location = MOTION) out vec4 motion;

#ifdef MATERIAL
layout(location = MATERIAL) out uint material; // 1 for the first
#endif

#include "render/screen/motion.glsl"
#include "shared/turned.glsl"

// Motion of what was behind the camera of the frame before (Rust: render::BEHIND_PX).
const float BEHIND_PX = 1e9;

// Clip depth is the near plane's depth, and w the view depth. Half of it leaves no doubt about what
// lies on the near plane and has not moved.
vec2 motion_of(vec4 then, vec4 now) {
    if (then.w < 0.5 * then.z) return vec2(BEHIND_PX);
    // Precise, so that equal places are 0 apart.
    precise vec2 place_then = then.xy / then.w, place_now = now.xy / now.w;
    precise vec2 apart = place_then - place_now;
    return 0.5 * vec2(frame.size_px.xy) * apart;
}

// Right-handed axes along the first edge of a triangle and its normal.
mat3 axes_of(vec3 a, vec3 b, vec3 c) {
    vec3 along = normalize(b - a), normal = normalize(cross(b - a, c - a));
    return mat3(along, cross(normal, along), normal);
}

// A direction on a triangle that has moved, as it was in the frame before.
vec3 direction_before(uvec3 triangle, vec3 direction) {
    vec3 a = position_of(triangle.x), b = position_of(triangle.y), c = position_of(triangle.z);
    return axes_of(previous_position(triangle.x, a), previous_position(triangle.y, b),
               previous_position(triangle.z, c))
        * (direction * axes_of(a, b, c));
}
#endif

// Shading normal from a tangent-space map, with the tangent frame of the triangle's texture
// coordinates. `spread` is the length of the mean of those in the pixel: less than 1 where it
// shows texels that differ. What is magnified shows interpolated normals, each of length 1.
vec3 mapped_normal(uvec3 triangle, vec3 normal, out float spread) {
    spread = 1.0;
    vec3 a = position_of(triangle.x);
    vec3 e1 = position_of(triangle.y) - a, e2 = position_of(triangle.z) - a;
    vec2 d1 = uvs[triangle.y] - uvs[triangle.x];
    vec2 d2 = uvs[triangle.z] - uvs[triangle.x];
    float determinant = d1.x * d2.y - d2.x * d1.y;
    if (abs(determinant) < 1e-20) return normal;
    vec3 tangent = (e1 * d2.y - e2 * d1.y) / determinant;
    tangent = tangent - normal * dot(normal, tangent);
    if (dot(tangent, tangent) < 1e-20) return normal;
    tangent = normalize(tangent);
    vec3 bitangent = cross(normal, tangent) * sign(determinant);
    vec3 local = texture(sampler2D(normal_texture, linear_repeat), uv).xyz * 2.0 - 1.0;
    vec3 mean = local.x * tangent + local.y * bitangent + local.z * normal;
    float lod = textureQueryLod(sampler2D(normal_texture, linear_repeat), uv).y;
    spread = mix(1.0, min(length(mean), 1.0), clamp(lod, 0.0, 1.0));
    return normalize(mean);
}

vec3 on_side_of(vec3 normal, vec3 shading) {
    return dot(shading, normal) < 0.0 ? -shading : shading;
}

// A depth is nearer by more than it is rounded: in a corner the place would else lie behind the
// other wall.
const float NEARER = 2e-6;

// View depth [m] where the pixel's ray meets the plane of its triangle. Rasterizers move corners to
// a grid of parts of a pixel (subPixelPrecisionBits). What they interpolate is off the plane by
// more than rays start off it, in small pictures far more. Beyond the corners, at edges and where
// the plane is seen edge-on, it is what they interpolate.
float depth_on_plane(vec3 a, vec3 b, vec3 c, float interpolated) {
    vec3 eye = frame.eye_ws.xyz, forward = frame.ray_forward.xyz, normal = cross(b - a, c - a);
    vec3 corners = vec3(dot(a - eye, forward), dot(b - eye, forward), dot(c - eye, forward));
    float least = max(min(corners.x, min(corners.y, corners.z)), 0.0);
    float most = max(corners.x, max(corners.y, corners.z));
    float depth = dot(normal, a - eye) / dot(normal, pixel_ray(ivec2(gl_FragCoord.xy)));
    return (depth > least && depth < most ? depth : interpolated) * (1.0 - NEARER);
}

void main() {
    uvec3 triangle = vertices_of(triangle_index);
    Material m = materials[triangle_materials[triangle_index]];
    bool is_cut = false;
    if (MASKED)
        is_cut = m.albedo.w > 0.0 && texture(sampler2D(mask_texture, linear_repeat), uv).r < 0.5;
    vec3 base = m.albedo.rgb;
    if (TEXTURED) base *= texture(sampler2D(albedo_texture, linear_repeat), uv).rgb;
    vec3 a = position_of(triangle.x), b = position_of(triangle.y), c = position_of(triangle.z);
    vec3 geometric = normalize(cross(b - a, c - a));
    vec3 shading = on_side_of(geometric, normalize(normal_ws));
    float spread = 1.0;
    if (BUMPED) {
        if (m.emission.w > 0.0)
            shading = on_side_of(geometric, mapped_normal(triangle, shading, spread));
    }
    vec3 to_eye = frame.eye_ws.xyz - position_ws;
    bool front = dot(geometric, to_eye) >= 0.0;
    view_depth_m = depth_on_plane(a, b, c, -dot(to_eye, frame.ray_forward.xyz));
    normals = front ? uvec2(pack_unit(geometric), pack_unit(shading))
                    : uvec2(pack_unit(-geometric), pack_unit(-shading));
    albedo = vec4(base, spread);
#ifdef GLOSSY
    albedo.rgb *= 1.0 - m.metalness.x;
    vec4 lobe = m.specular; // a roughness of −1 has no texture
    if (TEXTURED) lobe *= texture(sampler2D(lobe_texture, linear_repeat), uv);
    specular = vec4(lobe.w < 0.0 ? vec3(0.0) : mix(lobe.rgb, base, m.metalness.x), lobe.w);
#endif
#ifdef EMISSIVE
    vec3 radiance = m.emission.rgb;
    if (TEXTURED) radiance *= texture(sampler2D(emission_texture, linear_repeat), uv).rgb;
    emission = vec4(front ? radiance : vec3(0.0), 0.0);
#endif
#ifdef MOTION
    float turned = before.has_moved == 0u
        ? 0.0
        : pack_turned(direction_before(triangle, front ? shading : -shading));
    motion = vec4(motion_of(previous_clip, clip), previous_clip.w, turned);
#endif
#ifdef MATERIAL
    material = triangle_materials[triangle_index] + 1u;
#endif
    // Last: textures are sampled with the differences to neighbours, which have to be alive.
    if (is_cut) discard;
}
