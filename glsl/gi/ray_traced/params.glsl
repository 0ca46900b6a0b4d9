// What passes of paths are told (Rust: gi::ray_traced::PathParams).
layout(push_constant) uniform PathParams {
    vec4 grid;             // of the cache: smallest corner [m], voxel size [m]
    uint resolution;       // of the cache [voxels]
    uint ray_count;        // of all dispatches
    uint first_ray;        // of this dispatch, which adds to what those before it left
    uint end_ray;
    uint pattern;          // of a tile of pixels, each of which has directions of its own
    uint bounces;
    float hit_roughness;   // least width of lobes at what diffuse light comes from
} params;
