// The rays of a pixel, and what becomes of their light. The including pass binds `view_depth`,
// `normals` and `indirect_diffuse`.
#ifndef LUMIVOX_PIXEL
#define LUMIVOX_PIXEL

#include "shared/environment.glsl"
#include "shared/receiver.glsl"
#include "shared/directions.glsl"
#include "gi/shared/voxel/trace/chance.glsl"
#include "gi/shared/voxel/trace/ray_params.glsl"

const float GOLDEN_ANGLE = 2.399963229728653;

struct PixelRays {
    Surface surface;
    mat3 around;   // of its shading normal
    vec2 offset;   // of the pixel's directions
    uint seed;     // of the pixel
};

// False where nothing is gathered.
bool read_rays(ivec2 texel, out PixelRays rays) {
    if (!is_gathered(texel)) return false;
    if (!read_receiver(texel, rays.surface)) {
        imageStore(indirect_diffuse, texel, vec4(0.0));
        return false;
    }
    rays.around = frame_around(rays.surface.shading_normal);
    ivec2 place = place_of(texel);
    rays.offset = interleaved_offset(place, params.pattern, frame.walk.x);
    rays.seed = seed_of(uvec3(place, 0), frame.walk.x);
    return true;
}

// Directions are cosine-distributed around the shading normal.
vec3 ray_direction(PixelRays rays, uint i) {
    float u = (float(i) + rays.offset.x) / float(params.ray_count);
    return hemisphere_direction(
        rays.around, u, float(i) * GOLDEN_ANGLE + rays.offset.y * 2.0 * PI);
}

// What a ray that meets nothing brings.
vec3 environment_of(PixelRays rays, vec3 direction) {
    return environment_of_scattered(
        direction, dot(direction, rays.surface.shading_normal) / PI, params.ray_count);
}

// Adds what the rays of this dispatch have seen: E = π/n Σ L, V = 1 − 1/n Σ occlusion.
void store_rays(ivec2 texel, vec3 radiance, float occlusion) {
    vec4 before =
        params.first_ray == 0u ? vec4(0.0, 0.0, 0.0, 1.0) : imageLoad(indirect_diffuse, texel);
    imageStore(indirect_diffuse, texel,
        before + vec4(PI * radiance, -occlusion) / float(params.ray_count));
}

#endif
