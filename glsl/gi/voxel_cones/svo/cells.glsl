// Where texels of the table of cells and of blocks are: 1024 a row.
#ifndef LUMIVOX_CELLS
#define LUMIVOX_CELLS

ivec2 texel_of(uint number) {
    return ivec2(number & 1023u, number >> 10);
}

#endif
