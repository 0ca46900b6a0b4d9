#version 460
#extension GL_GOOGLE_include_directive : require
// voxel.fragments, method `raster`: projects the triangle along its dominant axis and enlarges it
// so that every column it touches has its centre covered: each edge moves outwards by half the
// pixel's extent along the edge's normal (Hasselgren et al. 2005, algorithm 2; Crassin & Green
// 2012, section 22.3.1). Rasterization only proposes columns; the exact test in the fragment shader
// decides. With HARDWARE the rasterizer itself is conservative and the triangle is left as it is.
layout(triangles) in;
layout(triangle_strip, max_vertices = 4) out;

#include "gi/shared/voxel/build/fetch.glsl"

layout(location = 0) flat in uint vertex_index[];
layout(location = 0) flat out uint triangle_index;

const float MARGIN = 1.0 / 16.0;   // above the rasterizer's sub-pixel snapping [pixels]

void emit_corner(uint triangle, ivec3 base, vec2 position) {
    triangle_index = triangle;
    gl_Position = vec4((position + vec2(base.xy)) * 2.0 / float(params.resolution) - 1.0, 0.5, 1.0);
    EmitVertex();
}

#ifndef HARDWARE
// The edge a→b as a line (n, c), n·p + c = 0, moved outwards; `side` is +1 for a counter-clockwise
// triangle.
vec3 moved_edge(vec2 a, vec2 b, float side) {
    vec2 n = side * vec2(b.y - a.y, a.x - b.x) / max(length(b - a), 1e-20);   // outwards
    return vec3(n, -dot(n, a) - 0.5 * (abs(n.x) + abs(n.y)) - MARGIN);
}

vec2 corner(vec3 first, vec3 second, out float sine) {
    sine = first.x * second.y - first.y * second.x;
    return vec2(first.y * second.z - second.y * first.z, second.x * first.z - first.x * second.z)
        / sine;
}

#endif

void main() {
    uint triangle = params.first_triangle + vertex_index[0] / 3u;
    TriangleSetup s;
    if (!fetch_triangle(triangle, s)) return;
#ifdef HARDWARE
    emit_corner(triangle, s.base, s.v0.xy);
    emit_corner(triangle, s.base, s.v1.xy);
    emit_corner(triangle, s.base, s.v2.xy);
#else
    float side = s.normal.z > 0.0 ? 1.0 : -1.0;
    vec3 ab = moved_edge(s.v0.xy, s.v1.xy, side), bc = moved_edge(s.v1.xy, s.v2.xy, side),
         ca = moved_edge(s.v2.xy, s.v0.xy, side);
    vec3 sine;
    vec2 a = corner(ca, ab, sine.x), b = corner(ab, bc, sine.y), c = corner(bc, ca, sine.z);
    vec3 sharp = abs(sine);
    if (min(sharp.x, min(sharp.y, sharp.z)) > 0.02) {
        emit_corner(triangle, s.base, a);
        emit_corner(triangle, s.base, b);
        emit_corner(triangle, s.base, c);
    } else {
        // A needle's corners would fly far away: propose its bounding box.
        vec2 low = vec2(s.low.xy) - MARGIN, high = vec2(s.high.xy) + 1.0 + MARGIN;
        emit_corner(triangle, s.base, low);
        emit_corner(triangle, s.base, vec2(high.x, low.y));
        emit_corner(triangle, s.base, vec2(low.x, high.y));
        emit_corner(triangle, s.base, high);
    }
#endif
    EndPrimitive();
}
