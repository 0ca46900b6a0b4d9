// The volume of gi/shared/cone/volume.glsl as the node pool and the brick pool of a sparse voxel
// octree. `params.face_stride`: bricks from a face of a tile to the next.
#include "gi/voxel_cones/svo/indirection.glsl"
#include "gi/voxel_cones/svo/pool.glsl"

layout(constant_id = 0) const uint CORNERS = 0;

layout(std430, set = 1, binding = VOLUME_BINDING) restrict readonly buffer Nodes { uint nodes[]; };
// Radiance premultiplied by opacity.
layout(set = 1, binding = VOLUME_BINDING + 1) uniform texture3D bricks;
// Mean normal of what shines, times its luminance; premultiplied by opacity, too.
layout(set = 1, binding = VOLUME_BINDING + 2) uniform texture3D normals_of_bricks;
layout(set = 1, binding = VOLUME_BINDING + 3) uniform utexture3D indirection;

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

// Place of a sample in the pool, given in texels from the centre of a brick's first.
vec3 brick_place(uint brick, vec3 local, ivec3 size) {
    return (vec3(brick_texel(brick, size)) + 0.5 + local) / vec3(size);
}

// Trilinear sample in the brick of a tile of a level, or in those of the three faces that a ray
// meets (gi/voxel_cones/svo/pool.glsl).
vec4 sample_tile(uint tile, int level, vec3 local, ivec3 size, vec3 direction) {
    vec4 texel;
    if (FACES && has_faces(level)) {
        uvec3 brick = tile + params.face_stride * uvec3(faces_met(direction));
        vec4 x =
            textureLod(sampler3D(bricks, linear_clamp), brick_place(brick.x, local, size), 0.0);
        vec4 y =
            textureLod(sampler3D(bricks, linear_clamp), brick_place(brick.y, local, size), 0.0);
        vec4 z =
            textureLod(sampler3D(bricks, linear_clamp), brick_place(brick.z, local, size), 0.0);
        texel = combine_faces(x, y, z, direction);
    } else {
        uint brick = tile;
        if (FACES) brick += 5u * params.face_stride;
        texel = textureLod(sampler3D(bricks, linear_clamp), brick_place(brick, local, size), 0.0);
    }
    return texel;
}

// Index + 1 and word of the tile of a cell on a level of the indirection texture, or 0.
uvec2 indirected_tile(ivec3 cell, int level, int root) {
    return texelFetch(usampler3D(indirection, nearest_clamp),
        indirection_texel(cell >> 1, level, root), 0)
        .xy;
}

// Trilinear sample of one level, by the hardware inside the brick of the tile that the position
// lies in: that of the indirection texture, and further down by the bits of the cell. Where a node
// has no child, all finer levels are empty.
VolumeTexel sample_level(vec3 position, float resolution, int level, int root, vec3 direction) {
    float scale = exp2(-float(level));
    vec3 at = lattice_position(position * scale, resolution * scale);
    ivec3 cell = min(ivec3(at), (ivec3(resolution) >> level) - 1);
    int first = max(level, first_indirected(root)), above = first - level;
    uvec2 found = indirected_tile(cell >> above, first, root);
    uint tile = found.x - 1u, node = child_index(uvec3(cell >> above));
    // One step down needs no further load.
    if (above > 0) {
        tile = child_of(found.y, node);
        above = has_child(found.y, node) ? above - 1 : -1;
    }
    if (found.x == 0u) above = -1;
    while (above > 0) {
        uint word = nodes[tile];
        node = child_index(uvec3(cell >> above));
        if (!has_child(word, node)) break;
        tile = child_of(word, node);
        --above;
    }
    VolumeTexel texel = VolumeTexel(vec4(0.0), vec3(0.0));
    ivec3 size = textureSize(sampler3D(bricks, linear_clamp), 0);
    if (above == 0) {
        vec3 local = at - vec3(cell & ivec3(-2));
        texel.light = sample_tile(tile, level, local, size, direction);
        if (NORMALS != 0u)
            texel.normal = textureLod(
                sampler3D(normals_of_bricks, linear_clamp), brick_place(tile, local, size), 0.0)
                               .xyz;
    }
    return texel;
}

// Quadrilinear sample at a position [voxels], seen along `direction`: linear between the two levels
// next to `level`.
vec4 sample_volume(vec3 position, float resolution, float level, vec3 direction) {
    int root = findMSB(uint(resolution)) - 1;
    level = clamp(level, 0.0, float(root));
    int finer = int(level);
    float coarser_share = level - float(finer);
    VolumeTexel texel = sample_level(position, resolution, finer, root, direction);
    vec4 light = (1.0 - coarser_share) * texel.light;
    vec3 normal = (1.0 - coarser_share) * texel.normal;
    if (coarser_share > 0.0) {
        texel = sample_level(position, resolution, finer + 1, root, direction);
        light += coarser_share * texel.light;
        normal += coarser_share * texel.normal;
    }
    if (NORMALS != 0u) light.rgb = seen_by_normals(light.rgb, normal, direction);
    return light;
}

// Between two levels the coarser one is looked up: where it has no tile, all finer levels are empty
// around the position.
bool may_see_matter(vec3 position, float resolution, float diameter) {
    int root = findMSB(uint(resolution)) - 1;
    // From 2^l up to 2^(l + 1) the coarser level is l + 1.
    int level = diameter > 1.0 ? (floatBitsToInt(diameter) >> 23) - 126 : 0;
    level = min(level, root);
    float scale = intBitsToFloat((127 - level) << 23);
    vec3 at = lattice_position(position * scale, resolution * scale);
    ivec3 cell = min(ivec3(at), (ivec3(resolution) >> level) - 1);
    int first = max(level, first_indirected(root)), above = first - level;
    uvec2 found = indirected_tile(cell >> above, first, root);
    return found.x != 0u && (above == 0 || has_child(found.y, child_index(uvec3(cell >> above))));
}

// Smallest diameter that a sample can have [voxels].
float least_diameter(vec3 position) {
    return 1.0;
}

// Edge of the largest texel that such a sample reads [voxels].
float largest_texel(vec3 position) {
    return 1.0;
}

float sampled_level(vec3 position, float resolution, float diameter) {
    return clamp(log2(diameter), 0.0, log2(resolution) - 1.0);
}

uint sides_of_voxels() {
    uint sides = 1u;
    if (FINEST_FACES) sides = 2u;
    if (NORMALS != 0u) sides = 2u;
    return sides;
}
