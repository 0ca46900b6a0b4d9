#version 460
#extension GL_GOOGLE_include_directive : require
// lpv.leaf_sources: what a leaf sends and which of its faces are opaque, as lpv.leaf_sweep reads
// it: three texels of x, y, z of a colour's flux over π times the area of a face of the leaf
// [W/(m² sr)], as bits of floats, and the word of faces of a leaf of one cell. Larger ones have no
// opaque face.
layout(local_size_x = 64) in;

#include "gi/lpv/grid.glsl"
#include "gi/lpv/octree/leaves.glsl"

layout(std430, set = 1, binding = 0) restrict readonly buffer Leaves { uint leaves[]; };
layout(std430, set = 1, binding = 1) restrict readonly buffer Faces { uint faces[]; };
layout(std430, set = 1, binding = 2) restrict readonly buffer Flux { int flux[]; };
layout(set = 1, binding = 3, rgba32ui) uniform restrict writeonly uimage3D sources;

layout(push_constant) uniform LeafSourceParams {
    CellGrid grid;         // size.w: leaves
    float radiance_unit;   // one integer step of flux, over π h² [W/(m² sr)]
} params;

void main() {
    uint leaf = gl_GlobalInvocationID.x;
    uint count = uint(params.grid.size.w);
    if (leaf >= count) return;
    uint level = leaf_level(leaves[leaf]);
    uint word = level == 0u ? faces[cell_index(params.grid, leaf_corner(leaves[leaf]))] : 0u;
    float unit = params.radiance_unit / float(1u << 2u * level);
    for (uint colour = 0u; colour < 3u; ++colour) {
        uint first = 3u * colour * count + leaf;
        vec3 vector = unit * vec3(flux[first], flux[first + count], flux[first + 2u * count]);
        imageStore(sources, leaf_texel(leaf, int(colour)), uvec4(floatBitsToUint(vector), word));
    }
}
