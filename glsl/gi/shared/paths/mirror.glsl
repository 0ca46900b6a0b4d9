// What glossy surfaces mirror, by paths along directions of the lobe's visible normals. The
// including pass declares view_depth, normals, specular, indirect_specular, `params` with
// ray_count, first_ray, end_ray and pattern, and MIRROR_BOUNCES. One that has LEFT mirrors where
// another pass has left 1 in alpha, if that constant is not 0.
#ifndef LUMIVOX_PATHS_MIRROR
#define LUMIVOX_PATHS_MIRROR

#include "shared/gbuffer.glsl"
#include "gi/shared/paths/path.glsl"
#include "gi/shared/paths/start.glsl"

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, ivec2(frame.size_px.xy)))) return;
    Surface surface;
    float mark = 0.0;
#ifdef LEFT
    if (LEFT != 0u) {
        mark = imageLoad(indirect_specular, pixel).a;
        if (mark == 0.0) return;
    }
#endif
    vec4 lobe = texelFetch(sampler2D(specular, nearest_clamp), pixel, 0);
    if (!read_surface(pixel, surface) || lobe.a < 0.0) {
        imageStore(indirect_specular, pixel, vec4(0.0));
        return;
    }
    vec3 to_eye = normalize(frame.eye_ws.xyz - surface.position_ws);
    PathVertex start = first_vertex(surface, to_eye, vec3(0.0), lobe.rgb, lobe.a);
    // Without a pattern each pixel begins anywhere.
    bool is_alone = (params.pattern & 0xffffu) == 0x101u;
    vec2 offset = is_alone
        ? unit_numbers(pcg3(uvec3(pixel, frame.walk.x))).xy
        : interleaved_offset(pixel, params.pattern, frame.walk.x);
    vec3 sum = vec3(0.0);
    for (uint i = params.first_ray; i < params.end_ray; ++i) {
        // The R2 sequence (Roberts 2018), from where the pixel is in its tile.
        vec2 random = fract(offset + float(i) * vec2(0.7548776662466927, 0.5698402909980532));
        bool escaped;
        uvec2 which = uvec2(frame.walk.x * params.ray_count + i, params.ray_count);
        sum += light_along(start, lobe_direction(start, random), pixel, which, MIRROR_BOUNCES,
            0.0, escaped);
    }
    vec3 before =
        params.first_ray == 0u ? vec3(0.0) : imageLoad(indirect_specular, pixel).rgb;
    imageStore(indirect_specular, pixel, vec4(before + sum / float(params.ray_count), mark));
}

#endif
