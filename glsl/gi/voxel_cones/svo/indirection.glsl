// The indirection texture: index + 1 of the tile at each place of a level, or 0 where there is none
// (as the indirection grids of Lefebvre, Hornus & Neyret 2005), and the tile's word. It has the
// coarser levels, up to 64 tiles along an edge; from there a descent is short. The finest of them
// is a cube; those above stand beside each other behind it.
#ifndef LUMIVOX_INDIRECTION
#define LUMIVOX_INDIRECTION

// log2 of tiles along an edge of its finest level, at most.
const int INDIRECTION_BITS = 6;

// Its finest level.
int first_indirected(int root) {
    return max(root - INDIRECTION_BITS, 0);
}

ivec3 indirection_texel(ivec3 tile, int level, int root) {
    int whole = 1 << min(root, INDIRECTION_BITS), edge = 1 << root - level;
    return edge == whole ? tile : tile + ivec3(whole - 2 * edge, 0, whole);
}

#endif
