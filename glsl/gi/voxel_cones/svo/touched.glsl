// The tiles of a level that the passes over bricks run on: all, static ones and then dynamic ones,
// or with TOUCHED those of a list.
#ifndef LUMIVOX_TOUCHED
#define LUMIVOX_TOUCHED

// The touched tiles of a level; after the first word the arguments of indirect dispatches in groups
// of 64 threads: of eight a tile, and of one.
struct Touched {
    uint count;
    uint texel_groups_x; uint texel_groups_y; uint texel_groups_z;
    uint tile_groups_x; uint tile_groups_y; uint tile_groups_z;
};

// Tile number `index` of a level whose static tiles are `count` from `first` on, and whose dynamic
// ones start at `first_dynamic`.
uint nth_tile(uint index, uint first, uint count, uint first_dynamic) {
    return index < count ? first + index : first_dynamic + (index - count);
}

#endif
