// What a cell sends and which of its faces are opaque, as lpv.sources writes it: in `sources` eight
// half floats, in `source_faces` the ninth and the two halves of the word of faces. The including
// pass declares these images.
#ifndef LUMIVOX_LPV_SOURCES
#define LUMIVOX_LPV_SOURCES

struct CellSource {
    mat3 vectors;   // a colour a column: its flux over π h², along the normals [W/(m² sr)]
    uint faces;     // the cell's word of faces
};

CellSource load_source(ivec3 cell) {
    uvec4 first = imageLoad(sources, cell), second = imageLoad(source_faces, cell);
    vec2 r = unpackHalf2x16(first.x), m = unpackHalf2x16(first.y), g = unpackHalf2x16(first.z),
         b = unpackHalf2x16(first.w);
    return CellSource(mat3(vec3(r, m.x), vec3(m.y, g), vec3(b, unpackHalf2x16(second.x).x)),
        second.y | second.z << 16);
}

uint load_faces(ivec3 cell) {
    uvec4 found = imageLoad(source_faces, cell);
    return found.y | found.z << 16;
}

#endif
