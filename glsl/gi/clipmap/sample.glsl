// Sampling of the clipmap; gi/cone/dense.glsl is the same of one dense texture.
//
// Positions are from the outermost level's smallest corner, in voxels of level 0. A sample is taken on the level that its cone's diameter asks for, or on
// the finest one that holds it where that is coarser; towards its border a level fades into the next.
#ifndef LUMIVOX_CLIPMAP_SAMPLE
#define LUMIVOX_CLIPMAP_SAMPLE

#include "shared/frame.glsl"
#include "gi/clipmap/atlas.glsl"

layout(constant_id = 0) const int N = 128;        // voxels along an edge of a level
layout(constant_id = 2) const int LEVELS = 5;

// The including pass declares `levels` (buffer of vec4), `clipmap` and `top` (texture3D, radiance premultiplied by opacity). A level's row is its smallest
// corner in positions, and x + n y + n² z of its first voxel modulo n, exact in a float.

// 1 inside a level, falling to 0 in a border of n/16 voxels, one voxel off its end.
float share_of_level(vec3 position, int level) {
    vec3 local = (position - levels[level].xyz) * exp2(-float(level));
    vec3 inside = min(local, float(N) - local);
    return clamp((min(inside.x, min(inside.y, inside.z)) - 1.0) * 16.0 / float(N), 0.0, 1.0);
}

// Finest level, from a given one on, that holds a position; with what the next one adds to it in its fading border.
float level_at(vec3 position, int level) {
    float share = share_of_level(position, level);
    while (share <= 0.0 && level < LEVELS - 1) {
        ++level;
        share = share_of_level(position, level);
    }
    return level < LEVELS - 1 ? float(level) + 1.0 - share : float(LEVELS - 1);
}

// Smallest diameter that a sample can have [voxels of level 0].
float least_diameter(vec3 position) {
    return exp2(level_at(position, 0));
}

// Edge of the largest texel that such a sample reads [voxels of level 0].
float largest_texel(vec3 position) {
    return exp2(ceil(level_at(position, 0)));
}

vec4 sample_level(vec3 position, int level) {
    int stored = min(level, LEVELS - 1), mip = max(level - LEVELS, 0);
    vec4 row = levels[stored];
    uint first = uint(row.w);
    vec3 wrap = vec3(first % uint(N), first / uint(N) % uint(N), first / uint(N * N));
    // The mips above have larger texels; none is filtered across the level's border.
    float texel = level < LEVELS ? 1.0 : exp2(float(mip + 1));
    vec3 local = clamp((position - row.xyz) * exp2(-float(stored)), vec3(0.5 * texel), vec3(float(N) - 0.5 * texel));
    vec3 at = (wrap + local) / float(N);
    vec4 result = vec4(0.0);
    for (int turn = int(level < LEVELS); turn > 0; --turn) {
        float layers = float(LEVELS * (N + 2));
        float layer = float(slab_layer(stored, N)) + fract(at.z) * float(N);
        result = textureLod(sampler3D(clipmap, linear_repeat), vec3(at.xy, layer / layers), 0.0);
    }
    for (int turn = int(level >= LEVELS); turn > 0; --turn) result = textureLod(sampler3D(top, linear_repeat), at, float(mip));
    return result;
}

// `level`: log2 of the sample's diameter [voxels of level 0]. Its light is the same in all directions.
vec4 sample_volume(vec3 position, float resolution, float level, vec3 direction) {
    float coarsest = float(LEVELS - 1 + findMSB(uint(N) / 8u));
    level = clamp(level, 0.0, coarsest);
    level = max(level, level_at(position, min(int(level), LEVELS - 1)));
    int finer = int(level);
    float coarser_share = level - float(finer);
    vec4 texel = (1.0 - coarser_share) * sample_level(position, finer);
    for (int turn = int(coarser_share > 0.0); turn > 0; --turn) texel += coarser_share * sample_level(position, finer + 1);
    return texel;
}

// Every sample is taken.
bool may_see_matter(vec3 position, float resolution, float diameter) {
    return true;
}

#endif
