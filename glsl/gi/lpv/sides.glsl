// What a cell sees of an opaque face.
#ifndef LUMIVOX_LPV_SIDES
#define LUMIVOX_LPV_SIDES

struct Side {
    vec4 place;       // xyz: the surface [m]; w: index of the cell, as bits
    vec4 normal;      // xyz: unit vector towards the cell; w: 0
    vec4 albedo;      // rgb: diffuse albedo; w: 0
    vec4 emission;    // rgb: what it emits towards the cell [W/(m² sr)]; w: 0
};

// Of the surfaces that a segment meets, the one nearest to the cell: the smallest of these.
uint nearness(float distance, uint triangle) {
    return uint(clamp(distance, 0.0, 1.0) * 1023.0) << 22 | (triangle & 0x3fffffu);
}

#endif
