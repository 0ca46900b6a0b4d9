// The space of gi/shared/voxel/trace/space.glsl as the octree: a table of its cells of 16³ voxels,
// and blocks of 4³ voxels.
layout(constant_id = SPACE_CONSTANT) const uint SIDES = 1;   // radiances of a voxel: 1, 2, 6
// words from a surface to the next: 7 of a record, or 3 packed
layout(constant_id = SPACE_CONSTANT + 1) const uint SURFACE_WORDS = 7;
// 1: radiances are texels, not words of a buffer
layout(constant_id = SPACE_CONSTANT + 2) const uint RADIANCE_TEXELS = 0;

#include "gi/shared/voxel/grid.glsl"
#include "gi/voxel_cones/svo/cells.glsl"

// a cell of 16³ voxels: bits of its blocks of 4³, number of the first block that is there, log2 of
// the edge of the empty node that it is in [voxels]
layout(set = 1, binding = SPACE_BINDING) uniform utexture2D cells;
// a block: bits of its voxels, number of the first voxel that is there
layout(set = 1, binding = SPACE_BINDING + 1) uniform utexture2D blocks;
layout(std430, set = 1, binding = SPACE_BINDING + 2) restrict readonly buffer Surfaces {
    uint surfaces[];
};
layout(std430, set = 1, binding = SPACE_BINDING + 3) restrict readonly buffer VoxelRadiance {
    uvec2 voxel_radiance[];
};
layout(set = 1, binding = SPACE_BINDING + 4) uniform utexture2D radiance_texels;

#define PACKED_RADIANCE(side) packed_radiance(side)
uvec2 packed_radiance(uint side) {
    if (RADIANCE_TEXELS != 0u)
        return texelFetch(usampler2D(radiance_texels, nearest_clamp), radiance_texel(side), 0).xy;
    return voxel_radiance[side];
}

#include "gi/shared/voxel/trace/radiance.glsl"

// Whether bit number `bit` is set; if not, `edge` is 2 in place of 1 where none of its eight is.
bool is_set(uvec2 words, uint bit, out int edge) {
    uint word = bit < 32u ? words.x : words.y;
    edge = (word >> (bit & 24u) & 255u) == 0u ? 2 : 1;
    return (word >> (bit & 31u) & 1u) != 0u;
}

// By loads that do not wait for a branch: lanes of a software driver's vector wait for each other.
SpaceCell cell_around(ivec3 place) {
    uvec3 at = uvec3(place >> 4);
    uint across = max(params.resolution >> 4, 1u);
    uvec4 cell = texelFetch(usampler2D(cells, nearest_clamp),
        texel_of(at.x + across * (at.y + across * at.z)), 0);
    uint bit = block_bit(uvec3(place) >> 2);
    int edge, edge_in_block;
    bool is_there = is_set(cell.xy, bit, edge);
    edge = (cell.x | cell.y) == 0u ? 1 << cell.w : 4 * edge;
    uint number = is_there ? cell.z + set_bits_below(cell.xy, bit) : 0u;
    uvec4 block = texelFetch(usampler2D(blocks, nearest_clamp), texel_of(number), 0);
    bit = block_bit(uvec3(place));
    int slot = -1;
    bool has_voxel = is_set(block.xy, bit, edge_in_block);
    if (is_there) edge = edge_in_block;
    if (is_there && has_voxel) slot = int(block.z + set_bits_below(block.xy, bit));
    return SpaceCell(edge, slot);
}

float voxel_edge(vec3 position) {
    return 1.0;
}

Voxel surface_of(uint slot) {
    uint at = slot * SURFACE_WORDS;
    Voxel voxel;
    if (SURFACE_WORDS == 3u) {
        voxel = unpack_surface(uvec3(surfaces[at], surfaces[at + 1u], surfaces[at + 2u]));
    } else {
        voxel.normal = surfaces[at + 2u];
        voxel.mean_position = surfaces[at + 4u];
        voxel.coverage = surfaces[at + 5u];
        voxel.across = surfaces[at + 6u];
    }
    return voxel;
}
