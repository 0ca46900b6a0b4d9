// The cube of views around a probe. Faces are numbered: two an axis, the positive side first.
#ifndef LUMIVOX_PROBES_CUBE
#define LUMIVOX_PROBES_CUBE

// Right, up and forward of a face.
vec3 to_face(uint face, vec3 way) {
    uint axis = face >> 1;
    vec3 turned = axis == 0u ? way.yzx : axis == 1u ? way.zxy : way.xyz;
    return (face & 1u) == 0u ? turned : vec3(turned.xy, -turned.z);
}

vec3 from_face(uint face, vec3 turned) {
    vec3 way = (face & 1u) == 0u ? turned : vec3(turned.xy, -turned.z);
    uint axis = face >> 1;
    return axis == 0u ? way.zxy : axis == 1u ? way.yzx : way.xyz;
}

// The face that shows a direction.
uint face_of(vec3 direction) {
    vec3 size = abs(direction);
    uint axis = size.x >= size.y && size.x >= size.z ? 0u : size.y >= size.z ? 1u : 2u;
    return 2u * axis + (direction[axis] < 0.0 ? 1u : 0u);
}

// The first texel of a face's tile; `row`: tiles beside each other in the image.
ivec2 tile_of_face(uint probe, uint face, uint row, uint edge) {
    uint tile = 6u * probe + face;
    return ivec2(tile % row, tile / row) * int(edge);
}

#endif
