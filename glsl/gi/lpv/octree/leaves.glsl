// Leaves of the octree, and where images have them.
#ifndef LUMIVOX_LPV_LEAVES
#define LUMIVOX_LPV_LEAVES

// Rust: of the same names in lpv::leaf_sweep
const uint LIST_ROW = 4096u;
const uint LEAF_ROW = 2048u;
const uint SLOT_ROW = 256u;

// A word: 9 bits of each coordinate of the smallest cell, then the level.
ivec3 leaf_corner(uint word) {
    return ivec3(word & 511u, word >> 9 & 511u, word >> 18 & 511u);
}

uint leaf_level(uint word) {
    return word >> 27;
}

ivec2 list_texel(uint place) {
    return ivec2(place % LIST_ROW, place / LIST_ROW);
}

ivec3 leaf_texel(uint leaf, int layer) {
    return ivec3(leaf % LEAF_ROW, leaf / LEAF_ROW, layer);
}

ivec3 slot_texel(uint slot, int layer) {
    return ivec3(slot % SLOT_ROW, slot / SLOT_ROW, layer);
}

#endif
