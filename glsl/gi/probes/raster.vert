#version 460
#extension GL_GOOGLE_include_directive : require
// probes.raster: vertex pulling by corners (shared/frame.glsl), one face of the cube around a
// probe.
layout(std430, set = 1, binding = 0) restrict readonly buffer ProbePlaces { vec4 probe_places[]; };
#define LIST_BINDING 1
#include "gi/probes/list.glsl"

layout(push_constant) uniform RasterParams {
    uint entry;      // of the list
    uint face;
    float near_m;    // the nearest that is seen
} params;

#include "shared/frame.glsl"
#include "gi/probes/cube.glsl"

layout(location = 0) out vec2 uv;
layout(location = 1) flat out uint triangle;

void main() {
    triangle = gl_VertexIndex;
    uint vertex = vertex_of_corner(triangle);
    vec3 place = probe_places[probe_list[params.entry].x].xyz;
    vec3 local = to_face(params.face, position_of(vertex) - place);
    uv = texture_uv(vertex);
    gl_Position = vec4(local.xy, params.near_m, local.z);
}
