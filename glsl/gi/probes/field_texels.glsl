// What a texel of a light field knows of the surface that its probe sees, and where it is in the
// images (Rust: gi::probes::field).
#ifndef LUMIVOX_PROBES_FIELD_TEXELS
#define LUMIVOX_PROBES_FIELD_TEXELS

#include "gi/probes/atlas.glsl"

// The nearest surface along the direction of a texel's middle.
struct FieldTexel {
    float distance;   // [cells], infinite where there is none
    vec3 normal;      // on the probe's side
};

uint pack_field_texel(FieldTexel texel) {
    uvec2 normal = uvec2(round(octahedral_from_unit(texel.normal) * 127.0) + 127.0);
    return packHalf2x16(vec2(texel.distance, 0.0)) | normal.x << 16 | normal.y << 24;
}

FieldTexel unpack_field_texel(uint packed) {
    vec2 normal = (vec2(packed >> 16 & 0xffu, packed >> 24) - 127.0) / 127.0;
    return FieldTexel(unpackHalf2x16(packed).x, unit_from_octahedral(normal));
}

// The first texel of a probe's map, which has no border.
ivec2 field_map(uint probe, uint columns, uint edge) {
    return ivec2(probe % columns, probe / columns) * int(edge);
}

// The probe whose map has a texel of the images.
uint probe_of_texel(ivec2 texel, uint columns, uint edge) {
    uvec2 map = uvec2(texel) / edge;
    return map.x + map.y * columns;
}

// The texel of a map that is shown at `texel`, up to one beyond an edge: there the sphere goes on
// as `border_of` says.
ivec2 texel_beyond(ivec2 texel, int edge) {
    ivec2 last = ivec2(edge - 1), inside = clamp(texel, ivec2(0), last);
    bvec2 is_beyond = notEqual(texel, inside);
    return ivec2(is_beyond.y ? last.x - inside.x : inside.x,
        is_beyond.x ? last.y - inside.y : inside.y);
}

#endif
