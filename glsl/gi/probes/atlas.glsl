// Octahedral maps of probes in an image: n² texels each, in a border of one.
#ifndef LUMIVOX_PROBES_ATLAS
#define LUMIVOX_PROBES_ATLAS

#include "shared/packing.glsl"

// The first texel of a probe's map, its border included.
ivec2 map_of(uint probe, uint columns, uint edge) {
    return ivec2(probe % columns, probe / columns) * int(edge + 2u);
}

// The direction of a texel of `edge`² texels.
vec3 direction_of_texel(vec2 texel, uint edge) {
    return unit_from_octahedral((texel + 0.5) * (2.0 / float(edge)) - 1.0);
}

// Where a direction is looked up, in texels of the image.
vec2 place_in_map(ivec2 map, uint edge, vec3 direction) {
    return vec2(map) + 1.0 + (octahedral_from_unit(direction) * 0.5 + 0.5) * float(edge);
}

// Texels of the border that show what `texel` shows, as offsets from the map's first texel: along
// an edge of the square the sphere goes on at the mirrored place of the same edge, and beyond a
// corner at the opposite one. x < 0: there is none.
ivec2[3] border_of(ivec2 texel, int edge) {
    ivec2 last = ivec2(edge - 1), mirrored = last - texel;
    ivec2 copies[3] = ivec2[](ivec2(-1), ivec2(-1), ivec2(-1));
    bool at_x = texel.x == 0 || texel.x == last.x, at_y = texel.y == 0 || texel.y == last.y;
    if (at_x) copies[0] = ivec2(texel.x == 0 ? 0 : edge + 1, mirrored.y + 1);
    if (at_y) copies[1] = ivec2(mirrored.x + 1, texel.y == 0 ? 0 : edge + 1);
    if (at_x && at_y)
        copies[2] = ivec2(texel.x == 0 ? edge + 1 : 0, texel.y == 0 ? edge + 1 : 0);
    return copies;
}

#endif
