#version 460
#extension GL_GOOGLE_include_directive : require
// clear.shadow: which share of a light passes what is clear, by the direction or the place of its
// rays. Nothing passes a body straight.
layout(local_size_x = 8, local_size_y = 8) in;

#include "render/bvh/bindings.glsl"

// What passes a material of the clear surfaces.
struct Clear {
    vec4 passes;   // rgb: share of light that passes one of its surfaces; w: index of refraction
};

layout(std430, set = 1, binding = 5) restrict readonly buffer ClearMaterials {
    Clear clear_materials[];
};
// as shared/clear_shadow.glsl has them
layout(std430, set = 1, binding = 6) restrict writeonly buffer ShadowRows { vec4 shadow_rows[]; };

layout(push_constant) uniform ClearShadowParams {
    vec4 middle;      // of a directional light, xyz: the map's middle [m]; w: half its edge [m]
    vec4 position;    // xyz: of another light [m]; w: 1
    vec4 direction;   // xyz: in which a directional light travels
    uint first_row;
    uint edge;        // rows
} params;

#include "shared/frame.glsl"
#include "shared/directions.glsl"
#include "shared/packing.glsl"
#include "render/bvh/traverse.glsl"

// Surfaces that light passes.
const uint MOST_SHEETS = 16u;

void main() {
    ivec2 texel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(uvec2(texel), uvec2(params.edge)))) return;
    if (texel == ivec2(0)) shadow_rows[params.first_row] = params.middle;
    vec2 place = (vec2(texel) + 0.5) / float(params.edge) * 2.0 - 1.0;
    bool is_parallel = params.position.w == 0.0;
    vec3 direction = is_parallel ? params.direction.xyz : unit_from_octahedral(place);
    vec3 origin = params.position.xyz;
    if (is_parallel) {
        mat3 around = frame_around(direction);
        origin = params.middle.xyz
            + params.middle.w * (around * vec3(place, -2.0));
    }
    float before = is_parallel ? -2.0 * params.middle.w : 0.0;
    float infinite = uintBitsToFloat(0x7f800000u), first = infinite, t = 0.0;
    vec3 left = vec3(1.0);
    uint leaves = NO_TRIANGLE;
    for (uint i = 0u; i < MOST_SHEETS; ++i) {
        RayHit hit =
            traverse(origin + t * direction, direction, infinite, leaves, NO_TRIANGLE, false);
        if (hit.triangle == NO_TRIANGLE) break;
        t += hit.t;
        leaves = hit.triangle;
        first = min(first, before + t);
        vec4 passes = clear_materials[triangle_materials[hit.triangle]].passes;
        left *= passes.w == 1.0 ? passes.rgb : vec3(0.0);
        if (left == vec3(0.0)) break;
    }
    uint row = params.first_row + 1u + uint(texel.y) * params.edge + uint(texel.x);
    shadow_rows[row] = vec4(left, first);
}
