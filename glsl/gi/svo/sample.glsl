// Sampling of the sparse radiance volume; gi/cone/dense.glsl is the same of the dense one.
#ifndef LUMIVOX_SVO_SAMPLE
#define LUMIVOX_SVO_SAMPLE

#include "shared/frame.glsl"
#include "gi/svo/pool.glsl"
#include "gi/svo/lit_normals.glsl"

// The including pass declares `nodes` (node pool), `bricks` (texture3D, radiance premultiplied by opacity) and `normals_of_bricks` (likewise, gi/svo/lit_normals.glsl).
layout(constant_id = 0) const uint CORNERS = 0;
layout(constant_id = 2) const uint NORMALS = 0;   // 1: texels are the light of both sides together, and shine by their normals

struct VolumeTexel {
    vec4 light;
    vec3 normal;   // mean normal of what shines, times its luminance
};

// Position on the lattice of a level, inside it.
vec3 lattice_position(vec3 position, float points) {
    vec3 at = clamp(position, vec3(0.0), vec3(points));
    if (CORNERS == 0u) at = clamp(at - 0.5, vec3(0.0), vec3(points - 1.0));
    return at;
}

// Trilinear sample of one level, by the hardware inside the brick of the tile that the position lies in: down from the root by the bits of the cell.
// Where a node has no child, all finer levels are empty.
VolumeTexel sample_level(vec3 position, float resolution, int level, int root) {
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
    VolumeTexel texel = VolumeTexel(vec4(0.0), vec3(0.0));
    ivec3 size = textureSize(sampler3D(bricks, linear_clamp), 0);
    // One turn or none of a loop, and not a branch: a software driver takes every branch, but leaves a loop when it may.
    for (; above == 0; --above) {
        vec3 local = at - vec3(cell & ivec3(-2));
        vec3 at_texel = (vec3(brick_texel(tile, size)) + 0.5 + local) / vec3(size);
        texel.light = textureLod(sampler3D(bricks, linear_clamp), at_texel, 0.0);
        if (NORMALS != 0u) texel.normal = textureLod(sampler3D(normals_of_bricks, linear_clamp), at_texel, 0.0).xyz;
    }
    return texel;
}

// Quadrilinear sample at a position [voxels], seen along `direction`: linear between the two levels next to `level`.
vec4 sample_volume(vec3 position, float resolution, float level, vec3 direction) {
    int root = findMSB(uint(resolution)) - 1;
    level = clamp(level, 0.0, float(root));
    int finer = int(level);
    float coarser_share = level - float(finer);
    VolumeTexel texel = sample_level(position, resolution, finer, root);
    vec4 light = (1.0 - coarser_share) * texel.light;
    vec3 normal = (1.0 - coarser_share) * texel.normal;
    for (int turn = int(coarser_share > 0.0); turn > 0; --turn) {
        texel = sample_level(position, resolution, finer + 1, root);
        light += coarser_share * texel.light;
        normal += coarser_share * texel.normal;
    }
    if (NORMALS != 0u) light.rgb *= facing_share(normal / max(luminance(light.rgb), 1e-20), direction);
    return light;
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
