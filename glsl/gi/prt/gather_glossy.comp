#version 460
#extension GL_GOOGLE_include_directive : require
// prt.gather_glossy: indirect specular radiance of glossy surfaces, L_s = Σ (F₀ u_j + u'_j) c_j:
// c is the radiance above points, u what the lobe makes of each of its harmonics.
layout(local_size_x = 8, local_size_y = 8) in;

#include "gi/prt/lobes.glsl"

layout(set = 1, binding = 6) uniform texture2D view_depth;
layout(set = 1, binding = 7) uniform utexture2D normals;
layout(set = 1, binding = 8) uniform texture2D specular;
layout(set = 1, binding = 9, rgba32f) uniform restrict writeonly image2D indirect_specular;

layout(constant_id = 1) const uint CLAMP = 1;   // no negative radiance

#include "shared/gbuffer.glsl"

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(indirect_specular)))) return;
    vec3 light = vec3(0.0);
    Surface surface;
    vec4 lobe = texelFetch(sampler2D(specular, nearest_clamp), pixel, 0);
    if (read_surface(pixel, surface) && lobe.a >= 0.0) {
        uvec4 cell = texelFetch(usampler2D(cells, nearest_clamp), pixel, 0);
        vec3 normal = unpack_unit(cell.w);
        vec3 from_eye = normalize(surface.position_ws - frame.eye_ws.xyz);
        // Where bumps show what comes from there, an eye without bumps would be elsewhere.
        vec3 mirrored = reflect(from_eye, surface.shading_normal);
        vec3 to_eye = reflect(-mirrored, normal);
        vec2 place = vec2(angle_place(dot(normal, to_eye)),
            clamp(lobe.a, 0.0, 1.0) * float(TABLE_EDGE - 1u));
        uvec2 low = min(uvec2(place), uvec2(TABLE_EDGE - 2u));
        vec2 part = place - vec2(low), rest = 1.0 - part;
        uint entry = low.y * TABLE_EDGE + low.x;
        Lobes lobes;
        if (lobes_of(cell, normal, to_eye, lobes))
            light = seen_through(lobes, lobe.rgb,
                uvec4(entry, entry + 1u, entry + TABLE_EDGE, entry + TABLE_EDGE + 1u),
                vec4(rest.x * rest.y, part.x * rest.y, rest.x * part.y, part.x * part.y));
        if (CLAMP != 0u) light = max(light, vec3(0.0));
    }
    imageStore(indirect_specular, pixel, vec4(light, 1.0));
}
