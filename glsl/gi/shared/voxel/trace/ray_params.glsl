// What a pixel's rays are told.
#ifndef LUMIVOX_RAY_PARAMS
#define LUMIVOX_RAY_PARAMS

layout(push_constant) uniform RayParams {
    vec4 grid;             // xyz: smallest corner of the space; w: edge of its finest voxels [m]
    uint resolution;       // edge of the space [voxels]
    uint part_count;       // of what emits
    uint ray_count;        // of all dispatches
    uint first_ray;        // of this dispatch, which adds to what those before it left
    uint end_ray;
    uint pattern;          // of a tile of pixels, each of which turns the rays differently
    float start_offset;    // [voxels]; not read against triangles
    float self_height;     // [voxels]
    float contour_slack;   // [voxels]
    float ao_falloff;      // [1/m]
} params;

#endif
