// What a volume answers. Each store has a volume.glsl that defines these functions and declares
// what they read: bindings of set 1 from VOLUME_BINDING on, which the pass defines, constants 0 and
// 2. An entry shader includes a pass of this folder, and then its store's volume.
#ifndef LUMIVOX_VOLUME
#define LUMIVOX_VOLUME

// What is seen along `direction` at a position [voxels]: radiance premultiplied by opacity,
// opacity. `level` is log2 of the sample's diameter [voxels].
vec4 sample_volume(vec3 position, float resolution, float level, vec3 direction);

// False only where a sample of this diameter [voxels, at least 1] is zero.
bool may_see_matter(vec3 position, float resolution, float diameter);

// Smallest diameter that a sample can have at a position [voxels].
float least_diameter(vec3 position);

// Edge of the largest texel that such a sample reads [voxels].
float largest_texel(vec3 position);

// The level that a sample of this diameter [voxels] is taken on.
float sampled_level(vec3 position, float resolution, float diameter);

// Radiances of a voxel: 1, or 2 where its sides have their own.
uint sides_of_voxels();

#endif
