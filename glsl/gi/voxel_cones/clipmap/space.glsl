// The space of gi/shared/voxel/trace/space.glsl as the levels of a clipmap. A place is in the
// finest level that holds it.
layout(constant_id = SPACE_CONSTANT) const uint SIDES = 1;   // radiances of a voxel: 1, 2, 6
layout(constant_id = SPACE_CONSTANT + 1) const int N = 128;   // voxels along an edge of a level
layout(constant_id = SPACE_CONSTANT + 2) const int LEVELS = 5;

#include "shared/frame.glsl"
#include "gi/shared/voxel/trace/blocks.glsl"

// Two rows a level, of which the first begins with its smallest corner [finest voxels].
layout(std430, set = 1, binding = SPACE_BINDING) restrict readonly buffer Levels { vec4 levels[]; };
// gi/shared/voxel/trace/blocks.glsl; those of a level after those of the finer one
layout(set = 1, binding = SPACE_BINDING + 1) uniform utexture3D blocks;
layout(std430, set = 1, binding = SPACE_BINDING + 2) restrict readonly buffer Surfaces {
    uint surfaces[];
};
layout(std430, set = 1, binding = SPACE_BINDING + 3) restrict readonly buffer VoxelRadiance {
    uvec2 voxel_radiance[];
};

#include "gi/shared/voxel/trace/radiance.glsl"

// The finest level that holds a place, and the voxel of it that the place is in.
int level_of(ivec3 place, out ivec3 voxel) {
    int finest = LEVELS - 1;
    voxel = place >> finest;
    // Every turn is taken, so that none is counted: a driver unrolls the loop.
    for (int level = LEVELS - 2; level >= 0; --level) {
        ivec3 at = place - ivec3(levels[2 * level].xyz) >> level;
        bool is_held = all(greaterThanEqual(at, ivec3(0))) && all(lessThan(at, ivec3(N)));
        finest = is_held ? level : finest;
        voxel = is_held ? at : voxel;
    }
    return finest;
}

SpaceCell cell_around(ivec3 place) {
    ivec3 voxel;
    int level = level_of(place, voxel);
    ivec3 at = (voxel >> 2) + ivec3(0, 0, level * (N >> 2));
    SpaceCell cell = cell_of_block(
        texelFetch(usampler3D(blocks, nearest_clamp), at, 0).xyz, block_bit(uvec3(voxel)));
    return SpaceCell(cell.edge << level, cell.slot);
}

float voxel_edge(vec3 position) {
    ivec3 voxel, last = ivec3((N << LEVELS - 1) - 1);
    return float(1 << level_of(clamp(ivec3(floor(position)), ivec3(0), last), voxel));
}

Voxel surface_of(uint slot) {
    uint at = 3u * slot;
    return unpack_surface(uvec3(surfaces[at], surfaces[at + 1u], surfaces[at + 2u]));
}
