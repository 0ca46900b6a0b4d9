// Where the bit of a voxel is that says whether it is inside along an axis.
#ifndef LUMIVOX_INSIDE
#define LUMIVOX_INSIDE

// `column`: the coordinates along the axes that follow this one; `along`: that along it.
uint word_of(uint axis, uvec2 column, uint along, uint resolution) {
    uint words = (resolution + 31u) >> 5;
    return ((axis * resolution + column.y) * resolution + column.x) * words + (along >> 5);
}

#endif
