#version 460
#extension GL_GOOGLE_include_directive : require
// light_field.trace: the surface that each texel of each probe sees, where that may have changed. A
// thread a texel.
layout(local_size_x = 8, local_size_y = 8) in;

#include "render/bvh/bindings.glsl"

layout(constant_id = 3) const uint KEEPS = 0;   // 1: what texels see stays where nothing moved

// w: 1 where the probe stands elsewhere than when it was traced
layout(std430, set = 1, binding = 5) restrict readonly buffer ProbePlaces { vec4 probe_places[]; };
// x: triangle; y: where on it, 16 bits each
layout(set = 1, binding = 6, rg32ui) uniform restrict writeonly uimage2D field_hits;
layout(set = 1, binding = 7, r32ui) uniform restrict uimage2D field_surfaces;

layout(push_constant) uniform FieldTraceParams {
    vec4 low;            // xyz: the box in which something has moved [m]
    vec4 high;
    uint columns;        // maps beside each other in the images
    uint edge;           // of a map [texels]
    uint probe_count;
    float cell_m;        // the smallest spacing
} params;

#include "render/bvh/traverse.glsl"
#include "gi/probes/field_texels.glsl"
#include "gi/probes/touches.glsl"

// A distance in half a word may be this share of it too short.
const float HALF_ROUNDING = 1e-3;

void main() {
    ivec2 texel = ivec2(gl_GlobalInvocationID.xy);
    uint probe = probe_of_texel(texel, params.columns, params.edge);
    if (texel.x >= int(params.columns * params.edge) || probe >= params.probe_count) return;
    vec3 direction = direction_of_texel(vec2(uvec2(texel) % params.edge), params.edge);
    vec4 place = probe_places[probe];
    if (KEEPS != 0u) {
        float distance = unpack_field_texel(imageLoad(field_surfaces, texel).r).distance;
        float far_m = distance * params.cell_m * (1.0 + HALF_ROUNDING);
        if (place.w == 0.0 && !touches_box(place.xyz, direction, far_m)) return;
    }
    RayHit hit = closest_hit(place.xyz, direction, NO_TRIANGLE);
    FieldTexel seen = FieldTexel(uintBitsToFloat(0x7f800000u), -direction);
    if (hit.triangle != NO_TRIANGLE) {
        uvec3 v = vertices_of(hit.triangle);
        vec3 a = position_of(v.x);
        vec3 normal = normalize(cross(position_of(v.y) - a, position_of(v.z) - a));
        seen.distance = min(hit.t / params.cell_m, LARGEST_HALF);
        seen.normal = dot(normal, direction) <= 0.0 ? normal : -normal;
    }
    imageStore(field_hits, texel, uvec4(hit.triangle, packUnorm2x16(hit.at), 0, 0));
    imageStore(field_surfaces, texel, uvec4(pack_field_texel(seen)));
}
