// Sampling of the sparse radiance volume; gi/cone/dense.glsl is the same of the dense one.
#ifndef LUMIVOX_SVO_SAMPLE
#define LUMIVOX_SVO_SAMPLE

#include "shared/frame.glsl"
#include "gi/svo/pool.glsl"

// The including pass declares `nodes` (node pool) and `bricks` (texture3D, radiance premultiplied by opacity).
layout(constant_id = 0) const uint SPREAD = 0;   // 1: lattice points are voxel corners; 0: voxel centres

// Trilinear, by the hardware, inside the brick of a tile at `level`.
vec4 sample_brick(uint tile, vec3 at, ivec3 cell, int level) {
    ivec3 size = textureSize(sampler3D(bricks, linear_clamp), 0);
    vec3 local = at * exp2(-float(level)) - vec3(2 * (cell >> (level + 1)));
    return textureLod(sampler3D(bricks, linear_clamp), (vec3(brick_texel(tile, size)) + 0.5 + local) / vec3(size), 0.0);
}

// Quadrilinear sample at a position [voxels]: down from the root to the two levels next to `level`. Where a node has no child, all finer levels are empty.
vec4 sample_volume(vec3 position, float resolution, float level) {
    float end = SPREAD != 0u ? resolution : resolution - 1.0;
    vec3 at = clamp(position - (SPREAD != 0u ? 0.0 : 0.5), vec3(0.0), vec3(end));
    ivec3 cell = min(ivec3(at), ivec3(resolution) - 1);
    int root = findMSB(uint(resolution)) - 1;
    level = clamp(level, 0.0, float(root));
    int finer = int(level);
    float coarser_share = level - float(finer);
    vec4 coarser = vec4(0.0);
    uint tile = 0u;
    for (int above = root; above > finer; --above) {
        uint node = nodes[8u * tile + child_index(uvec3(cell >> above))];
        if (above == finer + 1 && coarser_share > 0.0) coarser = coarser_share * sample_brick(tile, at, cell, above);
        if (node == 0u) return coarser;
        tile = node & NODE_INDEX;
    }
    return coarser + (1.0 - coarser_share) * sample_brick(tile, at, cell, finer);
}

#endif
