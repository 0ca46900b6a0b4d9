// Reading the G-buffer. The including pass declares `view_depth` and `normals`.
#ifndef LUMIVOX_GBUFFER
#define LUMIVOX_GBUFFER

#include "shared/frame.glsl"
#include "shared/packing.glsl"

struct Surface {
    vec3 position_ws;
    vec3 geometric_normal;   // on the viewer's side
    vec3 shading_normal;
};

// False where the pixel sees no surface.
bool read_surface(ivec2 pixel, out Surface surface) {
    float depth_m = texelFetch(sampler2D(view_depth, nearest_clamp), pixel, 0).r;
    uvec2 packed = texelFetch(usampler2D(normals, nearest_clamp), pixel, 0).rg;
    surface.position_ws = position_from_depth(pixel, depth_m);
    surface.geometric_normal = unpack_unit(packed.x);
    surface.shading_normal = unpack_unit(packed.y);
    return depth_m > 0.0;
}

#endif
