// A triangle of the scene, in grid coordinates.
#ifndef LUMIVOX_FETCH
#define LUMIVOX_FETCH

#include "shared/frame.glsl"
#include "gi/voxel/triangle_box.glsl"

layout(push_constant) uniform FragmentParams {
    vec4 origin_inverse_size;   // xyz: smallest corner of the whole grid [m]; w: 1 / voxel size [1/m]
    vec4 first_voxel;           // xyz: of the piece of it that is voxelized
    uint resolution;            // voxels along an edge of the piece
    uint first_triangle;
    uint triangle_count;
    uint material;              // of all triangles of the batch
    uint capacity;              // fragments that fit; further ones are counted only
    float emission_unit;        // radiance of the largest stored value, 2²¹ − 1 [W/(m² sr)]
} params;

vec3 grid_position(uint vertex) {
    precise vec3 p = (vertices[vertex].position - params.origin_inverse_size.xyz) * params.origin_inverse_size.w;
    return p - params.first_voxel.xyz;
}

// False where the triangle touches nothing.
bool fetch_triangle(uint index, out TriangleSetup setup) {
    uvec4 triangle = triangles[index];
    return setup_triangle(grid_position(triangle.x), grid_position(triangle.y), grid_position(triangle.z), int(params.resolution), setup);
}

#endif
