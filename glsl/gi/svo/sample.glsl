// Sampling of the sparse radiance volume; gi/cone/dense.glsl is the same of the dense one.
#ifndef LUMIVOX_SVO_SAMPLE
#define LUMIVOX_SVO_SAMPLE

#include "shared/frame.glsl"
#include "gi/cone/faces.glsl"
#include "gi/svo/pool.glsl"

// The including pass declares `nodes` (node pool), `bricks` (texture3D, radiance premultiplied by opacity) and `params.face_stride`.
layout(constant_id = 0) const uint CORNERS = 0;

// Position on the lattice of a level, inside it.
vec3 lattice_position(vec3 position, float points) {
    vec3 at = clamp(position, vec3(0.0), vec3(points));
    if (CORNERS == 0u) at = clamp(at - 0.5, vec3(0.0), vec3(points - 1.0));
    return at;
}

// Trilinear sample at a place in a brick, in texels from the centre of its first.
vec4 sample_brick(uint brick, vec3 local, ivec3 size) {
    return textureLod(sampler3D(bricks, linear_clamp), (vec3(brick_texel(brick, size)) + 0.5 + local) / vec3(size), 0.0);
}

// Likewise, of a tile of a level: of the three faces that a ray meets, or of the one brick of a level without faces (gi/svo/pool.glsl).
vec4 sample_tile(uint tile, int level, vec3 local, vec3 direction, ivec3 size) {
    vec4 texel = vec4(0.0);
    if (FACES) {
        for (int turn = int(!has_faces(level)); turn > 0; --turn) texel = sample_brick(tile + 5u * params.face_stride, local, size);
        for (int turn = int(has_faces(level)); turn > 0; --turn) {
            uvec3 brick = tile + params.face_stride * uvec3(faces_met(direction));
            texel = combine_faces(sample_brick(brick.x, local, size), sample_brick(brick.y, local, size), sample_brick(brick.z, local, size), direction);
        }
    } else {
        texel = sample_brick(tile, local, size);
    }
    return texel;
}

// Trilinear sample of one level, by the hardware inside the brick of the tile that the position lies in: down from the root by the bits of the cell.
// Where a node has no child, all finer levels are empty.
vec4 sample_level(vec3 position, vec3 direction, float resolution, int level, int root) {
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
        texel = sample_tile(tile, level, local, direction, size);
    }
    return texel;
}

// What is seen in a direction at a position [voxels]: linear between the two levels next to `level`.
vec4 sample_volume(vec3 position, vec3 direction, float resolution, float level) {
    int root = findMSB(uint(resolution)) - 1;
    level = clamp(level, 0.0, float(root));
    int finer = int(level);
    float coarser_share = level - float(finer);
    vec4 texel = (1.0 - coarser_share) * sample_level(position, direction, resolution, finer, root);
    for (int turn = int(coarser_share > 0.0); turn > 0; --turn) texel += coarser_share * sample_level(position, direction, resolution, finer + 1, root);
    return texel;
}

// Every sample is taken: a descent that ends early is short, and skips the bricks.
bool may_see_matter(vec3 position, float resolution, float diameter) {
    return true;
}

#endif
