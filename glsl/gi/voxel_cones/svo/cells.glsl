// Where texels of the table of cells and of blocks are, 1024 a row, and those of radiances, 16384
// a row.
#ifndef LUMIVOX_CELLS
#define LUMIVOX_CELLS

ivec2 texel_of(uint number) {
    return ivec2(number & 1023u, number >> 10);
}

ivec2 radiance_texel(uint number) {
    return ivec2(number & 16383u, number >> 14);
}

#endif
