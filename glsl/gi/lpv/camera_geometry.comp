#version 460
#extension GL_GOOGLE_include_directive : require
// lpv.camera_geometry: the surfaces of one layer that the camera sees, as what blocks light, as
// lpv.geometry has them of a light. A pixel is a surfel of area A = Ω r² / |cos|.
layout(local_size_x = 8, local_size_y = 8) in;

#include "shared/frame.glsl"
#include "shared/packing.glsl"
#include "gi/lpv/grid.glsl"

layout(set = 1, binding = 0) uniform texture2D view_depth;
layout(set = 1, binding = 1) uniform utexture2D normals;
// x, y, z of A n, then A, node by node
layout(std430, set = 1, binding = 2) restrict buffer AreaSums { int areas[]; };

layout(push_constant) uniform CameraGeometryParams {
    CellGrid grid;
    uvec2 size_px;     // of the layer's picture
    uint stride;       // pixels along an edge of the square that one pixel stands for
    float area_unit;   // one integer step [m²]
} params;

#include "gi/lpv/areas.glsl"

// Through a place of the picture, −1 to 1, to view depth 1.
vec3 ray_at(vec2 place) {
    return frame.ray_forward.xyz + place.x * frame.ray_right.xyz - place.y * frame.ray_up.xyz;
}

// What the middle pixel of a square sees, with the extent of the whole square.
Surfel read_surfel(ivec2 square) {
    ivec2 size = ivec2(params.size_px), first = square * int(params.stride);
    ivec2 end = min(first + int(params.stride), size), pixel = (first + end) / 2;
    Surfel found = Surfel(false, vec3(0.0), vec3(0.0), 0.0);
    if (any(greaterThanEqual(first, size))) return found;
    float depth_m = texelFetch(sampler2D(view_depth, nearest_clamp), pixel, 0).r;
    if (depth_m <= 0.0) return found;
    vec3 way = depth_m * ray_at((vec2(pixel) + 0.5) / vec2(size) * 2.0 - 1.0);
    found.is_there = true;
    found.position = frame.eye_ws.xyz + way;
    found.normal = unpack_unit(texelFetch(usampler2D(normals, nearest_clamp), pixel, 0).r);

    vec3 middle = ray_at(vec2(first + end) / vec2(size) - 1.0);
    vec2 edges = vec2(end - first) / vec2(size);
    float plane = 4.0 * edges.x * edges.y * length(frame.ray_right.xyz) * length(frame.ray_up.xyz);
    float squared = dot(middle, middle);
    float cosine = max(-dot(found.normal, normalize(way)), 1e-6);
    found.area = plane / (squared * sqrt(squared)) * dot(way, way) / cosine;
    return found;
}

void main() {
    ivec2 first = ivec2(gl_GlobalInvocationID.xy) * BLOCK;
    if (any(greaterThanEqual(first * int(params.stride), ivec2(params.size_px)))) return;
    Areas found = Areas(-1, vec4(0.0));
    for (int i = 0; i < BLOCK * BLOCK; ++i) collect(found, read_surfel(first + in_block(i)));
    add(found);
}
