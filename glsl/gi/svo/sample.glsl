// Sampling of the sparse radiance volume; gi/cone/dense.glsl is the same of the dense one.
#ifndef LUMIVOX_SVO_SAMPLE
#define LUMIVOX_SVO_SAMPLE

#include "shared/frame.glsl"
#include "gi/svo/pool.glsl"

// The including pass declares `nodes` (node pool) and `bricks` (texture3D, radiance premultiplied by opacity).
layout(constant_id = 0) const uint CORNERS = 0;

// Position on the lattice of a level, inside it.
vec3 lattice_position(vec3 position, float points) {
    vec3 at = clamp(position, vec3(0.0), vec3(points));
    if (CORNERS == 0u) at = clamp(at - 0.5, vec3(0.0), vec3(points - 1.0));
    return at;
}

// Trilinear sample of one level, by the hardware inside the brick of the tile that the position lies in: down from the root by the bits of the cell.
// Where a node has no child, all finer levels are empty.
vec4 sample_level(vec3 position, float resolution, int level, int root) {
    float scale = exp2(-float(level));
    vec3 at = lattice_position(position * scale, resolution * scale);
    ivec3 cell = min(ivec3(at), (ivec3(resolution) >> level) - 1);
    uint tile = 0u;
    int above = root - level;
    while (above > 0) {
        uint word = nodes[tile], node = child_index(uvec3(cell >> above));
        if (!has_child(word, node)) break;
        tile = child_of(word, node);
        --above;
    }
    vec4 texel = vec4(0.0);
    ivec3 size = textureSize(sampler3D(bricks, linear_clamp), 0);
    // One turn or none of a loop, and not a branch: a software driver takes every branch, but leaves a loop when it may.
    for (; above == 0; --above) {
        vec3 local = at - vec3(cell & ivec3(-2));
        texel = textureLod(sampler3D(bricks, linear_clamp), (vec3(brick_texel(tile, size)) + 0.5 + local) / vec3(size), 0.0);
    }
    return texel;
}

// Quadrilinear sample at a position [voxels]: linear between the two levels next to `level`.
vec4 sample_volume(vec3 position, float resolution, float level) {
    int root = findMSB(uint(resolution)) - 1;
    level = clamp(level, 0.0, float(root));
    int finer = int(level);
    float coarser_share = level - float(finer);
    vec4 texel = (1.0 - coarser_share) * sample_level(position, resolution, finer, root);
    for (int turn = int(coarser_share > 0.0); turn > 0; --turn) texel += coarser_share * sample_level(position, resolution, finer + 1, root);
    return texel;
}

// Every sample is taken: a descent that ends early is short, and skips the bricks.
bool may_see_matter(vec3 position, float resolution, float diameter) {
    return true;
}

// Smallest diameter that a sample can have [voxels].
float least_diameter(vec3 position) {
    return 1.0;
}

#endif
