// Tiles of the reflective shadow maps, by which texels are passed over that lie far from the voxels
// that are lit.
#ifndef LUMIVOX_TILES
#define LUMIVOX_TILES

const uint TILE = 8u;               // edge [texels]
// of a dispatch over listed tiles, along x: fewer than any device has
const uint GROUPS_ALONG = 32768u;

// Tiles along an edge of a map.
uint tile_row(uint map_size) { return (map_size + TILE - 1u) / TILE; }

#endif
