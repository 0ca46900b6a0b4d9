#version 460
#extension GL_GOOGLE_include_directive : require
// lpv.surfaces: place, normal, albedo and emission of the surfaces that lpv.nearest has found.
#include "gi/lpv/crossing.glsl"
#include "gi/lpv/sides.glsl"

layout(std430, set = 1, binding = 0) restrict readonly buffer Faces { uint faces[]; };
layout(std430, set = 1, binding = 1) restrict readonly buffer Nearest { uint nearest[]; };
layout(std430, set = 1, binding = 2) restrict writeonly buffer Sides { Side sides[]; };

void note(ivec3 cell, uint face, float distance, Side seen) {
    if (!is_in_box(cell)) return;
    int index = cell_index(params.grid, cell);
    uint side = side_of(faces[index], face);
    if (nearest[side] != nearness(distance, triangle_index)) return;
    // The cell is on the lower side of a face of odd number.
    bool is_front = (seen.normal[params.low.w] > 0.0) != ((face & 1u) != 0u);
    seen.place.w = intBitsToFloat(index);
    seen.normal.xyz = is_front ? seen.normal.xyz : -seen.normal.xyz;
    if (!is_front) seen.emission = vec4(0.0);
    sides[side] = seen;
}

void main() {
    Crossing crossing = find_crossing();
    Material material = materials[triangle_materials[triangle_index]];
    vec3 place = vec3(params.grid.first.xyz + crossing.low) + 0.5;
    place[params.low.w] += crossing.share;
    vec2 uv = crossing.uv;
    Side seen = Side(vec4(params.grid.place.xyz + params.grid.place.w * place, 0.0),
        vec4(normalize(crossing.normal), 0.0),
        vec4(material.albedo.rgb * (1.0 - material.metalness.x)
                * texture(sampler2D(albedo_texture, linear_repeat), uv).rgb,
            0.0),
        vec4(material.emission.rgb * texture(sampler2D(emission_texture, linear_repeat), uv).rgb,
            0.0));
    uint face = 2u * uint(params.low.w);
    note(crossing.low, face + 1u, crossing.share, seen);
    note(crossing.high, face, 1.0 - crossing.share, seen);
}
