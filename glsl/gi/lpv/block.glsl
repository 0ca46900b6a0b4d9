// Squares of texels that a thread reads: neighbours in one cell are added as one.
#ifndef LUMIVOX_LPV_BLOCK
#define LUMIVOX_LPV_BLOCK

const int BLOCK = 4;   // texels along an edge

// There and back again from row to row: neighbours are often in one cell.
ivec2 in_block(int i) {
    int row = i / BLOCK;
    return ivec2((row & 1) == 0 ? i % BLOCK : BLOCK - 1 - i % BLOCK, row);
}

#endif
