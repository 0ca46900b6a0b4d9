// The volume of gi/shared/cone/volume.glsl as a 3D texture with all mips.
#include "gi/voxel_cones/matter.glsl"

// Whether empty samples are looked up in the matter pyramid and skipped.
layout(constant_id = 0) const bool SKIP_EMPTY = true;

// Radiance premultiplied by opacity; with faces on coarser levels its level 0 alone.
layout(set = 1, binding = VOLUME_BINDING) uniform texture3D voxels;
layout(set = 1, binding = VOLUME_BINDING + 1) uniform utexture3D matter;
// The levels with six faces, one cube beside the other along x.
layout(set = 1, binding = VOLUME_BINDING + 2) uniform texture3D faces;
// With NORMALS: the mean normal of what shines, times its luminance; premultiplied by opacity, too.
layout(set = 1, binding = VOLUME_BINDING + 3) uniform texture3D normals_of_voxels;

// Trilinear sample of the three faces that a ray meets on a level, as one texel. Each cube is
// clamped to its own edge.
vec4 sample_faces(vec3 position, float resolution, int level, vec3 direction) {
    float half_texel = exp2(float(level) - 1.0);
    vec3 along = (clamp(position.x, half_texel, resolution - half_texel) / resolution
                     + vec3(faces_met(direction)))
        / 6.0;
    vec2 across = position.yz / resolution;
    float mip = float(FINEST_FACES ? level : level - 1);
    vec4 x = textureLod(sampler3D(faces, linear_clamp), vec3(along.x, across), mip);
    vec4 y = textureLod(sampler3D(faces, linear_clamp), vec3(along.y, across), mip);
    vec4 z = textureLod(sampler3D(faces, linear_clamp), vec3(along.z, across), mip);
    return combine_faces(x, y, z, direction);
}

// Trilinear sample of one level.
vec4 sample_level(vec3 position, float resolution, int level, vec3 direction) {
    vec4 texel;
    if (has_faces(level)) texel = sample_faces(position, resolution, level, direction);
    else texel = textureLod(sampler3D(voxels, linear_clamp), position / resolution, 0.0);
    return texel;
}

// Linear between the two levels next to `level`.
vec4 sample_levels(vec3 position, float resolution, float level, vec3 direction) {
    int finer = int(level);
    float coarser_share = level - float(finer);
    vec4 texel = (1.0 - coarser_share) * sample_level(position, resolution, finer, direction);
    if (coarser_share > 0.0)
        texel += coarser_share * sample_level(position, resolution, finer + 1, direction);
    return texel;
}

// What is seen along `direction` at a position [voxels].
vec4 sample_volume(vec3 position, float resolution, float level, vec3 direction) {
    if (FACES)
        return sample_levels(position, resolution, clamp(level, 0.0, log2(resolution)), direction);
    vec3 at = position / resolution;
    vec4 texel = textureLod(sampler3D(voxels, linear_clamp), at, level);
    if (NORMALS != 0u) {
        vec3 normal = textureLod(sampler3D(normals_of_voxels, linear_clamp), at, level).xyz;
        texel.rgb = seen_by_normals(texel.rgb, normal, direction);
    }
    return texel;
}

// False only where a sample of this diameter [voxels, at least 1] is zero. Between two mips the
// coarser one's stencil holds the finer one's.
bool may_see_matter(vec3 position, float resolution, float diameter) {
    bool may_see = true;
    if (SKIP_EMPTY) {
        int size = int(resolution);
        // From 2^l up to 2^(l + 1) the mip is l + 1.
        int mip = diameter > 1.0 ? min((floatBitsToInt(diameter) >> 23) - 126, findMSB(size)) : 0;
        float scale = intBitsToFloat((127 - mip) << 23);
        ivec3 stencil = clamp(ivec3(position * scale - 0.5), ivec3(0), ivec3((size >> mip) - 1));
        may_see =
            (texelFetch(usampler3D(matter, nearest_clamp), matter_texel(stencil, size, mip), 0).r
                    >> stencil_bit(stencil)
                & 1u)
            != 0u;
    }
    return may_see;
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
    return clamp(log2(diameter), 0.0, log2(resolution));
}

uint sides_of_voxels() {
    uint sides = 1u;
    if (FINEST_FACES) sides = 2u;
    if (NORMALS != 0u) sides = 2u;
    return sides;
}
