// The radiance of the surface that each texel of some light fields sees: a thread a texel. The
// including pass declares `params` with `edge`, `columns` and `probe_count`, and what
// light_of_hit() takes.
#ifndef LUMIVOX_PROBES_FIELD_LIGHT
#define LUMIVOX_PROBES_FIELD_LIGHT

#include "shared/environment.glsl"
#include "gi/probes/reflected.glsl"
#include "gi/probes/field_texels.glsl"

void main() {
    ivec2 texel = ivec2(gl_GlobalInvocationID.xy);
    uint columns = params.columns, edge = params.edge;
    bool is_there = texel.x < int(columns * edge)
        && probe_of_texel(texel, columns, edge) < params.probe_count;
    if (!is_there) return;
    uvec2 hit = texelFetch(usampler2D(field_hits, nearest_clamp), texel, 0).rg;
    vec3 direction = direction_of_texel(vec2(uvec2(texel) % edge), edge), light;
    if (hit.x == NO_TRIANGLE) {
        // Texels of the square have 4 |d|₁³ / n² steradians.
        float sum = abs(direction.x) + abs(direction.y) + abs(direction.z);
        light = environment_around(direction, 4.0 * sum * sum * sum / float(edge * edge));
    } else {
        light = light_of_hit(hit.x, unpackUnorm2x16(hit.y), direction);
    }
    imageStore(field_radiance, texel, uvec4(pack_rgbe(light)));
}

#endif
