// Tiles of dynamic geometry, behind the static ones in the pool, and tile 0, the entry: the root of
// what is sampled, which is found as slot 0.
#ifndef LUMIVOX_DYNAMIC
#define LUMIVOX_DYNAMIC

uint dynamic_slot(uint tile, uint first_dynamic) {
    return tile == 0u ? 0u : tile - first_dynamic + 1u;
}

#endif
