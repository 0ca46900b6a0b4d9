// Sampling of the dense radiance volume; gi/svo/sample.glsl is the same of the sparse one.
#ifndef LUMIVOX_DENSE
#define LUMIVOX_DENSE

// The including pass declares `voxels` (texture3D, radiance premultiplied by opacity).
vec4 sample_volume(vec3 position, float resolution, float level) {
    return textureLod(sampler3D(voxels, linear_clamp), position / resolution, level);
}

#endif
