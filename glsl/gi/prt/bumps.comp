#version 460
#extension GL_GOOGLE_include_directive : require
// prt.bumps: adds what bumped normals change in the irradiance of points, whose transfer is that of
// the surface: the radiance above them falls on another normal.
layout(local_size_x = 8, local_size_y = 8) in;

#include "gi/prt/lobes.glsl"

layout(set = 1, binding = 6) uniform texture2D view_depth;
layout(set = 1, binding = 7) uniform utexture2D normals;
layout(set = 1, binding = 8, rgba32f) uniform restrict image2D diffuse;

layout(constant_id = 1) const uint CLAMP = 1;   // no negative irradiance

#include "shared/gbuffer.glsl"

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(diffuse)))) return;
    Surface surface;
    if (!read_surface(pixel, surface)) return;
    uvec4 cell = texelFetch(usampler2D(cells, nearest_clamp), pixel, 0);
    vec3 normal = unpack_unit(cell.w), bumped = surface.shading_normal;
    Lobes lobes;
    // Both are packed in few bits: what differs less is not bumped.
    if (dot(normal, bumped) > 1.0 - 1e-6 || !lobes_of(cell, normal, bumped, lobes)) return;
    float place = angle_place(dot(normal, bumped));
    uint low = min(uint(place), TABLE_EDGE - 2u);
    float part = place - float(low);
    vec4 before = imageLoad(diffuse, pixel);
    // Entry 0 is what there is without bumps.
    vec3 light = before.rgb
        + seen_through(lobes, vec3(0.0), uvec4(low, low + 1u, 0u, 0u),
            vec4(1.0 - part, part, -1.0, 0.0));
    if (CLAMP != 0u) light = max(light, vec3(0.0));
    imageStore(diffuse, pixel, vec4(light, before.a));
}
