#version 460
#extension GL_GOOGLE_include_directive : require
// lpv.gather_directions: irradiance and ambient visibility off the surface,
// E = Σ w max(0, −ω·n) L: what a batch of directions brings.
layout(local_size_x = 8, local_size_y = 8) in;

#include "gi/lpv/directions.glsl"

layout(std430, set = 1, binding = 0) restrict readonly buffer Directions {
    uvec4 octants[8];      // x: its first pair of directions; y: how many pairs it has
    Direction directions[];
};
layout(set = 1, binding = 1, rgba32ui) uniform restrict readonly uimage3D radiance;
layout(set = 1, binding = 2) uniform texture2D view_depth;
layout(set = 1, binding = 3) uniform utexture2D normals;
layout(set = 1, binding = 4, rgba32f) uniform restrict image2D indirect_diffuse;

#include "shared/receiver.glsl"
#include "gi/lpv/by_direction.glsl"

void main() {
    ivec2 texel = ivec2(gl_GlobalInvocationID.xy);
    if (!is_gathered(texel)) return;
    Surface surface;
    vec4 result = vec4(0.0);
    if (read_receiver(texel, surface)) {
        Corners corners = corners_off(surface);
        for (uint slab = 0u; slab < params.octant_count; ++slab) {
            uvec4 octant = octants[params.first_octant + slab];
            for (uint k = 0u; k < params.pair_count; ++k) {
                if (params.first_pair + k >= octant.y) break;
                uint at = 2u * (octant.x + params.first_pair + k);
                Direction both[2] = Direction[2](directions[at], directions[at + 1u]);
                vec4 first = both[0].travel, second = both[1].travel;
                vec2 shares =
                    vec2(first.w * max(-dot(first.xyz, surface.shading_normal), 0.0),
                        second.w * max(-dot(second.xyz, surface.shading_normal), 0.0));
                if (shares.x + shares.y <= 0.0) continue;
                Pair found = radiance_at(corners, int(slab * params.pair_count + k));
                vec4 sum = shares.x * with_sky(both[0], found.radiance[0])
                    + shares.y * with_sky(both[1], found.radiance[1]);
                result += vec4(whole(sum), sum.a / PI);
            }
        }
    }
    if (ADD) result += imageLoad(indirect_diffuse, texel);
    result.a = min(result.a, 1.0);
    imageStore(indirect_diffuse, texel, result);
}
