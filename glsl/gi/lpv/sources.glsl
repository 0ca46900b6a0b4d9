// What a cell sends and which of its faces are opaque: two texels of half floats, side by side, as
// lpv.sources writes them. The including pass declares `sources`, an image of them.
#ifndef LUMIVOX_LPV_SOURCES
#define LUMIVOX_LPV_SOURCES

struct CellSource {
    mat3 vectors;   // a colour a column: its flux over π h², along the normals [W/(m² sr)]
    uint faces;     // the cell's word of faces
};

CellSource load_source(ivec3 cell, int size_x) {
    uvec4 first = imageLoad(sources, cell);
    uvec2 second = imageLoad(sources, cell + ivec3(size_x, 0, 0)).xy;
    vec2 r = unpackHalf2x16(first.x), m = unpackHalf2x16(first.y), g = unpackHalf2x16(first.z),
         b = unpackHalf2x16(first.w);
    return CellSource(
        mat3(vec3(r, m.x), vec3(m.y, g), vec3(b, unpackHalf2x16(second.x).x)), second.y);
}

uint load_faces(ivec3 cell, int size_x) {
    return imageLoad(sources, cell + ivec3(size_x, 0, 0)).y;
}

#endif
