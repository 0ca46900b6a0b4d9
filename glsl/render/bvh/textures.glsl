// Textures of any material, bilinearly filtered as the reference does. The including pass binds
// what render/bvh/bindings.glsl declares.
#ifndef LUMIVOX_BVH_TEXTURES
#define LUMIVOX_BVH_TEXTURES

#include "shared/frame.glsl"
#include "render/bvh/bindings.glsl"

// What the scene has (Rust: graph::SCENE_CONSTANTS). Unless it knows, a driver that runs both sides
// of a branch looks textures up where there are none.
layout(constant_id = 66) const bool TEXTURED_SCENE = true;
layout(constant_id = 67) const bool LOBE_TEXTURES = true;

const uint ALBEDO_TEXTURE = 0u, EMISSION_TEXTURE = 1u, NORMAL_TEXTURE = 2u, MASK_TEXTURE = 3u;
const uint LOBE_TEXTURE = 4u;
const uint TEXTURES = 5u; // of a material

vec4 texel_at(uint index) {
    ivec3 place = ivec3(index & 4095u, index >> 12 & 4095u, index >> 24);
    uint packed = texelFetch(usampler2DArray(texels, nearest_clamp), place, 0).r;
    return vec4(uvec4(packed, packed >> 8, packed >> 16, packed >> 24) & 255u) / 255.0;
}

vec3 linear_from_srgb(vec3 c) {
    return mix(c / 12.92, pow((c + 0.055) / 1.055, vec3(2.4)), greaterThan(c, vec3(0.04045)));
}

int wrapped(float position, int size) {
    int at = int(position - floor(position / float(size)) * float(size));
    return at >= size ? at - size : max(at, 0);
}

vec4 sample_texture_at(uint material, uint slot, vec2 uv, bool is_color, vec4 absent) {
    uvec2 row = texture_rows[TEXTURES * material + slot];
    if (row.y == 0u) return absent;
    ivec2 size = ivec2(row.y & 0xffffu, row.y >> 16);
    precise vec2 place = vec2(uv.x, 1.0 - uv.y) * vec2(size) - 0.5;
    precise vec2 low = floor(place), f = place - low;
    int left = wrapped(low.x, size.x), top = wrapped(low.y, size.y);
    int right = left + 1 == size.x ? 0 : left + 1, bottom = top + 1 == size.y ? 0 : top + 1;
    vec4 sums[2];
    for (int i = 0; i < 2; ++i) {
        uint first = row.x + uint((i == 0 ? top : bottom) * size.x);
        vec4 a = texel_at(first + uint(left)), b = texel_at(first + uint(right));
        if (is_color) {
            a.rgb = linear_from_srgb(a.rgb);
            b.rgb = linear_from_srgb(b.rgb);
        }
        sums[i] = a * (1.0 - f.x) + b * f.x;
    }
    return sums[0] * (1.0 - f.y) + sums[1] * f.y;
}

// One of a material's textures at (u, v), v upwards; `absent` where it has none.
vec4 texture_at(uint material, uint slot, vec2 uv, bool is_color, vec4 absent) {
    if (TEXTURED_SCENE) return sample_texture_at(material, slot, uv, is_color, absent);
    return absent;
}

// (u, v) of a place on a triangle, by the barycentric coordinates of its second and third vertex.
vec2 uv_on(uint triangle, vec2 at) {
    uvec3 v = vertices_of(triangle);
    precise vec2 uv = (1.0 - at.x - at.y) * uvs[v.x] + at.x * uvs[v.y] + at.y * uvs[v.z];
    return uv;
}

// Whether the mask of the triangle's material leaves a surface there.
bool is_solid(uint triangle, vec2 at) {
    uint material = triangle_materials[triangle];
    return texture_at(material, MASK_TEXTURE, uv_on(triangle, at), false, vec4(1.0)).r >= 0.5;
}

#endif
