// A triangle of the scene, in grid coordinates.
#ifndef LUMIVOX_FETCH
#define LUMIVOX_FETCH

#include "shared/frame.glsl"
#include "gi/voxel/triangle_box.glsl"

layout(push_constant) uniform FragmentParams {
    vec4 origin_inverse_size;   // xyz: smallest corner of the grid [m]; w: 1 / voxel size [1/m]
    uint resolution;            // voxels along an edge of the grid
    uint first_triangle;
    uint triangle_count;
    uint capacity;              // fragments that fit; further ones are counted only
    float emission_unit;        // radiance of the largest stored value, 2²¹ − 1 [W/(m² sr)]
} params;

struct Attributes {
    uint material;
    vec2 uv0, uv1, uv2;
    float lod_area;             // area in texture coordinates per voxel face of surface
};

vec3 grid_position(uint vertex) {
    precise vec3 p = (vertices[vertex].position - params.origin_inverse_size.xyz) * params.origin_inverse_size.w;
    return p;
}

bool fetch_triangle(uint index, out TriangleSetup setup, out Attributes attributes) {
    uvec4 triangle = triangles[index];
    attributes.material = triangle.w;
    attributes.uv0 = texture_uv(vertices[triangle.x]);
    attributes.uv1 = texture_uv(vertices[triangle.y]);
    attributes.uv2 = texture_uv(vertices[triangle.z]);
    bool some = setup_triangle(grid_position(triangle.x), grid_position(triangle.y), grid_position(triangle.z), int(params.resolution), setup);
    vec2 e1 = attributes.uv1 - attributes.uv0, e2 = attributes.uv2 - attributes.uv0;
    attributes.lod_area = abs(e1.x * e2.y - e1.y * e2.x) / max(length(setup.normal), 1e-20);
    return some;
}

#endif
