// What exact rays walk through: the voxels of a store, and the empty space between them. An entry
// shader defines SPACE_BINDING and SPACE_CONSTANT, the first binding and the first constant of the
// space, and includes a pass of this folder and then the store's space, which defines the functions
// below.
//
// Places are in voxels of the finest kind, from the smallest corner of the space.
#ifndef LUMIVOX_SPACE
#define LUMIVOX_SPACE

#include "gi/shared/voxel/records.glsl"

// A voxel, or a cube of empty space.
struct SpaceCell {
    int edge;   // a power of two, of which the cell's smallest corner is a multiple
    int slot;   // number of the voxel's record; −1 in empty space
};

// The cell at a place inside the space.
SpaceCell cell_around(ivec3 place);

// A voxel's record, or as much of it as rays ask for: mean position, mean normal, sides.
Voxel surface_of(uint slot);

// Edge of the voxels that a pixel at a position looks from [voxels of the finest kind].
float voxel_edge(vec3 position);

// Radiances of a voxel: 2 where each side has its own, 6 where each face has.
uint sides_of_voxels();

// Radiance of a surface in a voxel, whose unit normal faces the viewer [W/(m² sr)].
vec3 radiance_towards(uint slot, vec3 facing);

// Radiance of what a ray sees of a voxel that it hits [W/(m² sr)].
vec3 radiance_along(uint slot, vec3 direction);

#endif
