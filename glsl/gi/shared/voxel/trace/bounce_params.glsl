// What the rays of voxels are told.
#ifndef LUMIVOX_BOUNCE_PARAMS
#define LUMIVOX_BOUNCE_PARAMS

layout(push_constant) uniform BounceRayParams {
    vec4 grid;             // xyz: smallest corner of the space; w: edge of its finest voxels [m]
    vec4 first_voxel;      // xyz: of the grid that the voxels are of [their size]
    uint resolution;       // edge of the space [voxels]
    uint voxel_count;
    uint part_count;       // of what emits
    uint ray_count;        // of all dispatches
    uint first_ray;        // of this dispatch, which adds to what those before it left
    uint end_ray;
    float voxel_scale;     // edge of the voxels that gather [voxels of the space]
    float start_offset;    // [voxels]
    float self_height;     // [voxels]
    float contour_slack;   // [voxels]
} params;

#endif
