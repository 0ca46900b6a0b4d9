// A voxel's radiances as one for all directions. The including file declares `voxel_radiance`, half
// floats r, g, b and a weight, or defines PACKED_RADIANCE, which reads them, and SIDES.
//
// | sides | weight |
// | 1     | opacity |
// | 2     | front: opacity; back: s/r (9b) |
// | 6     | +x, +y, +z: share of the area across the axis, times s/r; −x: opacity |
#ifndef LUMIVOX_MERGED
#define LUMIVOX_MERGED

#include "shared/packing.glsl"

#ifndef PACKED_RADIANCE
#define PACKED_RADIANCE(side) voxel_radiance[side]
#endif

// Radiance and weight.
vec4 side_of_voxel(uint side) {
    uvec2 packed = PACKED_RADIANCE(side);
    return vec4(unpackHalf2x16(packed.x), unpackHalf2x16(packed.y));
}

// Radiance for all directions, and opacity.
vec4 merged_radiance(uint voxel) {
    vec4 first = side_of_voxel(SIDES * voxel), merged = first;
    if (SIDES == 2u) {
        vec4 back = side_of_voxel(2u * voxel + 1u);
        merged.rgb = (first.rgb + back.rgb) * back.w;
    }
    if (SIDES == 6u) {
        merged = vec4(0.0);
        for (uint axis = 0u; axis < 3u; ++axis) {
            vec4 along = side_of_voxel(6u * voxel + 2u * axis),
                 against = side_of_voxel(6u * voxel + 2u * axis + 1u);
            merged.rgb += (along.rgb + against.rgb) * along.w;
            if (axis == 0u) merged.w = against.w;
        }
    }
    return vec4(min(merged.rgb, vec3(LARGEST_HALF)), merged.w);
}

#endif
