#version 460
#extension GL_GOOGLE_include_directive : require
// lpv.sources: what a cell sends and which of its faces are opaque, a texel of each of two images.
// Half floats, as all radiance on its way; gi/lpv/sources.glsl reads them.
layout(local_size_x = 8, local_size_y = 8) in;

#include "gi/lpv/grid.glsl"

layout(std430, set = 1, binding = 0) restrict readonly buffer Faces { uint faces[]; };
layout(std430, set = 1, binding = 1) restrict readonly buffer Flux { int flux[]; };
layout(set = 1, binding = 2, rgba32ui) uniform restrict writeonly uimage3D sources;
layout(set = 1, binding = 3, rgba16ui) uniform restrict writeonly uimage3D source_faces;

layout(push_constant) uniform SourceParams {
    CellGrid grid;
    float radiance_unit;   // one integer step of flux, over π h² [W/(m² sr)]
} params;

void main() {
    ivec3 size = params.grid.size.xyz, cell = ivec3(gl_GlobalInvocationID);
    if (!is_inside(params.grid, cell)) return;
    int index = cell_index(params.grid, cell), cells = size.x * size.y * size.z;
    mat3 vectors;   // a colour a column: its flux over π h², along the normals [W/(m² sr)]
    for (int colour = 0; colour < 3; ++colour) {
        int first = 3 * colour * cells + index;
        vectors[colour] = params.radiance_unit
            * vec3(flux[first], flux[first + cells], flux[first + 2 * cells]);
    }
    vec3 r = vectors[0], g = vectors[1], b = vectors[2];
    imageStore(sources, cell,
        uvec4(packHalf2x16(r.xy), packHalf2x16(vec2(r.z, g.x)), packHalf2x16(g.yz),
            packHalf2x16(b.xy)));
    uint word = faces[index];
    imageStore(source_faces, cell,
        uvec4(packHalf2x16(vec2(b.z, 0.0)), word & 0xffffu, word >> 16, 0u));
}
