#version 460
#extension GL_GOOGLE_include_directive : require
// lpv.specular_directions: radiance around the mirror direction r, what a batch of directions
// brings: Σ w exp((−ω·r − 1)/α²) L over the sum of these weights. Such a lobe is a Gaussian of
// width α.
layout(local_size_x = 8, local_size_y = 8) in;

#include "gi/lpv/directions.glsl"

layout(std430, set = 1, binding = 0) restrict readonly buffer Directions {
    uvec4 octants[8];      // x: its first pair of directions; y: how many pairs it has
    Direction directions[];
};
layout(set = 1, binding = 1, rgba32ui) uniform restrict readonly uimage3D radiance;
layout(set = 1, binding = 2) uniform texture2D view_depth;
layout(set = 1, binding = 3) uniform utexture2D normals;
layout(set = 1, binding = 4) uniform texture2D specular;
// rgb: of all batches so far; a: their weights, 0 after the last
layout(set = 1, binding = 5, rgba32f) uniform restrict image2D indirect_specular;

#include "shared/gbuffer.glsl"
#include "shared/ggx.glsl"
#include "gi/lpv/by_direction.glsl"

// What is further off the lobe's middle than this many widths weighs nothing.
const float REACH = 4.0;

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, ivec2(frame.size_px.xy)))) return;
    Surface surface;
    vec4 lobe = texelFetch(sampler2D(specular, nearest_clamp), pixel, 0);
    vec4 result = vec4(0.0);
    if (read_surface(pixel, surface) && lobe.a >= 0.0) {
        vec3 to_eye = normalize(frame.eye_ws.xyz - surface.position_ws);
        vec3 mirror = reflect(-to_eye, surface.shading_normal);
        float alpha = ggx_alpha(lobe.a), width = max(alpha * alpha, params.least_width);
        Corners corners = corners_off(surface);
        for (uint slab = 0u; slab < params.octant_count; ++slab) {
            uvec4 octant = octants[params.first_octant + slab];
            for (uint k = 0u; k < params.pair_count; ++k) {
                if (params.first_pair + k >= octant.y) break;
                uint at = 2u * (octant.x + params.first_pair + k);
                Direction both[2] = Direction[2](directions[at], directions[at + 1u]);
                vec4 first = both[0].travel, second = both[1].travel;
                vec2 off = 1.0 + vec2(dot(first.xyz, mirror), dot(second.xyz, mirror));
                if (min(off.x, off.y) > 0.5 * REACH * REACH * width) continue;
                vec2 shares = vec2(first.w, second.w) * exp(-off / width);
                Pair found = radiance_at(corners, int(slab * params.pair_count + k));
                vec4 sum = shares.x * with_sky(both[0], found.radiance[0])
                    + shares.y * with_sky(both[1], found.radiance[1]);
                result += vec4(whole(sum), shares.x + shares.y);
            }
        }
        if (ADD) result += imageLoad(indirect_specular, pixel);
        if (LAST) {
            float cosine = max(dot(surface.shading_normal, to_eye), 0.0);
            vec3 mean = result.a > 0.0 ? result.rgb / result.a : vec3(0.0);
            result = vec4(ggx_albedo(lobe.rgb, lobe.a, cosine) * mean, 0.0);
        }
    }
    imageStore(indirect_specular, pixel, result);
}
