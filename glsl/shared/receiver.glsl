// Surfaces that light is gathered for, a texel each (shared/gathered.glsl). The including pass
// declares `view_depth` and `normals` with those texels.
#ifndef LUMIVOX_RECEIVER
#define LUMIVOX_RECEIVER

#include "shared/gathered.glsl"
#include "shared/gbuffer.glsl"

// False where there is no surface.
bool read_receiver(ivec2 texel, out Surface surface) {
    float depth_m = texelFetch(sampler2D(view_depth, nearest_clamp), texel, 0).r;
    uvec2 packed = texelFetch(usampler2D(normals, nearest_clamp), texel, 0).rg;
    surface.position_ws = position_from_depth(pixel_of(place_of(texel)), depth_m);
    surface.geometric_normal = unpack_unit(packed.x);
    surface.shading_normal = unpack_unit(packed.y);
    return depth_m > 0.0;
}

#endif
