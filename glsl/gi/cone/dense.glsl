// Sampling of the dense radiance volume; gi/svo/sample.glsl is the same of the sparse one.
#ifndef LUMIVOX_DENSE
#define LUMIVOX_DENSE

#include "gi/voxel_mips/matter.glsl"

// Whether empty samples are looked up in the matter pyramid and skipped.
layout(constant_id = 0) const bool SKIP_EMPTY = true;

// Its light is the same in all directions. The including pass declares `voxels` (texture3D, radiance premultiplied by opacity) and `matter` (utexture3D, the matter pyramid).
vec4 sample_volume(vec3 position, float resolution, float level, vec3 direction) {
    return textureLod(sampler3D(voxels, linear_clamp), position / resolution, level);
}

// False only where a sample of this diameter [voxels, at least 1] is zero. Between two mips the coarser one's stencil holds the finer one's.
bool may_see_matter(vec3 position, float resolution, float diameter) {
    bool may_see = true;
    if (SKIP_EMPTY) {
        int size = int(resolution);
        // From 2^l up to 2^(l + 1) the mip is l + 1.
        int mip = diameter > 1.0 ? min((floatBitsToInt(diameter) >> 23) - 126, findMSB(size)) : 0;
        float scale = intBitsToFloat((127 - mip) << 23);
        ivec3 stencil = clamp(ivec3(position * scale - 0.5), ivec3(0), ivec3((size >> mip) - 1));
        may_see = (texelFetch(usampler3D(matter, nearest_clamp), matter_texel(stencil, size, mip), 0).r >> stencil_bit(stencil) & 1u) != 0u;
    }
    return may_see;
}

// Smallest diameter that a sample can have [voxels].
float least_diameter(vec3 position) {
    return 1.0;
}

#endif
