// The volume of gi/shared/cone/volume.glsl as the levels of a clipmap.
//
// Positions are from the outermost level's smallest corner, in voxels of level 0. A sample is taken
// on the level that its cone's diameter asks for, or on the finest one that holds it where that is
// coarser; towards its border a level fades into the next.
#include "gi/voxel_cones/clipmap/atlas.glsl"
#include "gi/voxel_cones/clipmap/filled.glsl"

layout(constant_id = 0) const int N = 128;        // voxels along an edge of a level
layout(constant_id = 2) const int LEVELS = 5;

// Two rows a level: its smallest corner in positions, with x + n y + n² z of its first voxel modulo
// n, exact in a float; and the point from which it fades, at most two of its voxels from its
// middle: a level moves by whole blocks, which is not to be seen.
layout(std430, set = 1, binding = VOLUME_BINDING) restrict readonly buffer Levels {
    vec4 levels[];
};
// Radiance premultiplied by opacity, of all levels, and of the mips above.
layout(set = 1, binding = VOLUME_BINDING + 1) uniform texture3D clipmap;
layout(set = 1, binding = VOLUME_BINDING + 2) uniform texture3D top;
layout(set = 1, binding = VOLUME_BINDING + 3) uniform utexture3D matter;
// With NORMALS: the mean normal of what shines, times its luminance; premultiplied by opacity, too.
layout(set = 1, binding = VOLUME_BINDING + 4) uniform texture3D normals_of_levels;
layout(set = 1, binding = VOLUME_BINDING + 5) uniform texture3D normals_of_top;

// 1 inside a level, falling to 0 in a border of n/16 voxels, one voxel off the nearest that its end
// can be.
float share_of_level(vec3 position, int level) {
    vec3 local = abs(position - levels[2 * level + 1].xyz) * exp2(-float(level));
    float inside = 0.5 * float(N) - 3.0 - max(local.x, max(local.y, local.z));
    return clamp(inside * 16.0 / float(N), 0.0, 1.0);
}

// Finest level, from a given one on, that holds a position; and in its fading border, how far that
// has gone. The loop is unrolled, for rows are cheap to read where all lanes read the same.
float faded_level(vec3 position, int level) {
    float faded = float(LEVELS - 1);
    for (int l = LEVELS - 2; l >= 0; --l) {
        float share = share_of_level(position, l);
        faded = l >= level && share > 0.0 ? float(l) + 1.0 - share : faded;
    }
    return faded;
}

// The same, as samples are taken: in the first quarter of the border cones that start there move
// off their surface, by as much as the next level's texels reach; those come in over the rest.
float level_at(vec3 position, int level) {
    float faded = faded_level(position, level);
    return floor(faded) + max(4.0 * fract(faded) - 1.0, 0.0) / 3.0;
}

// Smallest diameter that a sample can have [voxels of level 0].
float least_diameter(vec3 position) {
    return exp2(level_at(position, 0));
}

// Edge of the largest texel that such a sample reads, or is about to read [voxels of level 0].
float largest_texel(vec3 position) {
    float faded = faded_level(position, 0);
    return exp2(floor(faded) + min(4.0 * fract(faded), 1.0));
}

// Where a face of a level is stored; 0 where there is one for all directions. Positions and rows
// are modulo N.
vec3 stored_place(vec3 at, int face, int level) {
    float layers = float(LEVELS * (N + 2)), y = at.y;
    if (FACES) y = (float(face_row(face, N)) + fract(at.y) * float(N)) / float(6 * (N + 2));
    float z = (float(slab_layer(level, N)) + fract(at.z) * float(N)) / layers;
    return vec3(at.x, y, z);
}

// Trilinear sample of a face of a level.
vec4 sample_stored(vec3 at, int face, int level) {
    return textureLod(sampler3D(clipmap, linear_repeat), stored_place(at, face, level), 0.0);
}

// The same for a mip above the outermost level, at a position in its cube.
vec4 sample_top(vec3 at, int face, int mip) {
    if (FACES) at.x = (float(face) + at.x) / 6.0;
    return textureLod(sampler3D(top, linear_clamp), at, float(mip));
}

// A position in a level, or in the outermost one for a mip above it [its voxels].
struct InLevel {
    vec3 local;    // from its smallest corner, no nearer to its border than half a texel
    float first;   // w of its row
};

InLevel in_level(vec3 position, int level) {
    int stored = min(level, LEVELS - 1);
    vec4 row = levels[2 * stored];
    // The mips above have larger texels; none is filtered across the level's border.
    float half_texel = 0.5 * exp2(float(level - stored));
    return InLevel(clamp((position - row.xyz) * exp2(-float(stored)), vec3(half_texel),
                       vec3(float(N) - half_texel)),
        row.w);
}

struct VolumeTexel {
    vec4 light;
    vec3 normal;   // mean normal of what shines, times its luminance
};

// Trilinear sample of one level.
VolumeTexel sample_level(vec3 position, int level, vec3 direction) {
    int stored = min(level, LEVELS - 1), mip = max(level - LEVELS, 0);
    InLevel at_level = in_level(position, level);
    uint first = uint(at_level.first);
    vec3 wrap = vec3(first % uint(N), first / uint(N) % uint(N), first / uint(N * N));
    vec3 at = (wrap + at_level.local) / float(N), in_top = at_level.local / float(N);
    bool is_stored = level < LEVELS, six = FACES && has_faces(level);
    ivec3 met = faces_met(direction);
    vec4 result;
    if (is_stored && !six) {
        result = sample_stored(at, 0, stored);
    } else if (is_stored) {
        result = combine_faces(sample_stored(at, met.x, stored), sample_stored(at, met.y, stored),
            sample_stored(at, met.z, stored), direction);
    } else if (FACES) {
        result = combine_faces(sample_top(in_top, met.x, mip), sample_top(in_top, met.y, mip),
            sample_top(in_top, met.z, mip), direction);
    } else {
        result = sample_top(in_top, 0, mip);
    }
    VolumeTexel texel = VolumeTexel(result, vec3(0.0));
    if (NORMALS != 0u && is_stored) {
        texel.normal = textureLod(
            sampler3D(normals_of_levels, linear_repeat), stored_place(at, 0, stored), 0.0)
                           .xyz;
    } else if (NORMALS != 0u) {
        texel.normal =
            textureLod(sampler3D(normals_of_top, linear_clamp), in_top, float(mip)).xyz;
    }
    return texel;
}

// The level of a sample, between two: `level` is log2 of its diameter [voxels of level 0].
float level_of_sample(vec3 position, float level) {
    float coarsest = float(LEVELS - 1 + findMSB(uint(N) / 8u));
    level = clamp(level, 0.0, coarsest);
    return max(level, level_at(position, min(int(level), LEVELS - 1)));
}

vec4 sample_volume(vec3 position, float resolution, float level, vec3 direction) {
    level = level_of_sample(position, level);
    int finer = int(level);
    float coarser_share = level - float(finer);
    VolumeTexel texel = sample_level(position, finer, direction);
    vec4 light = (1.0 - coarser_share) * texel.light;
    vec3 normal = (1.0 - coarser_share) * texel.normal;
    if (coarser_share > 0.0) {
        texel = sample_level(position, finer + 1, direction);
        light += coarser_share * texel.light;
        normal += coarser_share * texel.normal;
    }
    if (NORMALS != 0u) light.rgb = seen_by_normals(light.rgb, normal, direction);
    return light;
}

float sampled_level(vec3 position, float resolution, float diameter) {
    return level_of_sample(position, log2(diameter));
}

// False only where a sample of this diameter [voxels of level 0] is zero. Between two levels the
// coarser one's stencil holds the finer one's.
bool may_see_matter(vec3 position, float resolution, float diameter) {
    int level = int(ceil(level_of_sample(position, log2(diameter)))),
        mip = max(level - LEVELS + 1, 0);
    vec3 texels = in_level(position, level).local * exp2(-float(mip)) - 0.5;
    ivec3 stencil = clamp(ivec3(texels), ivec3(0), ivec3((N >> mip) - 1));
    uint word = texelFetch(usampler3D(matter, nearest_clamp),
        filled_texel(stencil >> ivec3(2, 2, 1), level, N, LEVELS), 0).r;
    return (word >> stencil_bit(stencil) & 1u) != 0u;
}

uint sides_of_voxels() {
    uint sides = 1u;
    if (FINEST_FACES) sides = 2u;
    if (NORMALS != 0u) sides = 2u;
    return sides;
}
