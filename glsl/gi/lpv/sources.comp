#version 460
#extension GL_GOOGLE_include_directive : require
// lpv.sources: what a cell sends and which of its faces are opaque, as lpv.sweep reads it.
layout(local_size_x = 8, local_size_y = 8) in;

#include "gi/lpv/grid.glsl"

layout(std430, set = 1, binding = 0) restrict readonly buffer Faces { uint faces[]; };
layout(std430, set = 1, binding = 1) restrict readonly buffer Flux { int flux[]; };
layout(set = 1, binding = 2, rgba32ui) uniform restrict uimage3D sources;

layout(push_constant) uniform SourceParams {
    CellGrid grid;
    float radiance_unit;   // one integer step of flux, over π h² [W/(m² sr)]
} params;

#include "gi/lpv/sources.glsl"

void main() {
    ivec3 size = params.grid.size.xyz, cell = ivec3(gl_GlobalInvocationID);
    if (!is_inside(params.grid, cell)) return;
    int index = cell_index(params.grid, cell), cells = size.x * size.y * size.z;
    mat3 vectors;
    for (int colour = 0; colour < 3; ++colour) {
        int first = 3 * colour * cells + index;
        vectors[colour] = params.radiance_unit
            * vec3(flux[first], flux[first + cells], flux[first + 2 * cells]);
    }
    store_source(cell, size.x, CellSource(vectors, faces[index]));
}
