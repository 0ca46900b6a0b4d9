// A triangle of the scene, in grid coordinates.
#ifndef LUMIVOX_FETCH
#define LUMIVOX_FETCH

#include "shared/frame.glsl"
#include "gi/shared/voxel/build/triangle_box.glsl"

layout(push_constant) uniform FragmentParams {
    // xyz: smallest corner of the whole grid [m]; w: 1 / voxel size [1/m]
    vec4 origin_inverse_size;
    // xyz: of the piece of it that is voxelized; w: grains of a voxel that positions are rounded
    // to, 0: they are not
    vec4 first_voxel;
    uint resolution;            // voxels along an edge of the piece
    uint first_triangle;
    uint triangle_count;
    uint material;              // of all triangles of the batch
    uint capacity;              // fragments that fit; further ones are counted only
    float emission_unit;        // radiance of the largest stored value, 2²¹ − 1 [W/(m² sr)]
    uint clip_x;                // first and last voxel of the piece that is asked for, 16 bits each
    uint clip_y;
    uint clip_z;
} params;

vec3 grid_position(uint vertex) {
    precise vec3 p =
        (position_of(vertex) - params.origin_inverse_size.xyz) * params.origin_inverse_size.w;
    // Whole grains are exact in a float wherever the piece is, as long as they are less than 2²⁴
    // away.
    float grains = params.first_voxel.w;
    if (grains > 0.0) p = floor(p * grains + 0.5) / grains;
    return p - params.first_voxel.xyz;
}

// False where the triangle touches nothing.
bool fetch_triangle(uint index, out TriangleSetup setup) {
    uvec3 triangle = vertices_of(index);
    uvec3 clipped = uvec3(params.clip_x, params.clip_y, params.clip_z);
    Clip clip = Clip(ivec3(clipped & 0xffffu), ivec3(clipped >> 16), int(params.resolution),
        params.first_voxel.w > 0.0);
    return setup_triangle(grid_position(triangle.x), grid_position(triangle.y),
        grid_position(triangle.z), clip, setup);
}

#endif
