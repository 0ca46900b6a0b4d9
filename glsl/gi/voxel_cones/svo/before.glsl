// The tiles before a tile of the octree.
#ifndef LUMIVOX_BEFORE
#define LUMIVOX_BEFORE

// The including pass declares `neighbours`. Index + 1 of the neighbour along an axis of the tile
// with this index + 1; 0 where there is none. A neighbour across an edge or a corner is found by
// way of those across faces: where one of them does not exist, the texels that they share are
// empty.
uint before(uint tile, uint axis) {
    return tile == 0u ? 0u : neighbours[3u * (tile - 1u) + axis];
}

#endif
