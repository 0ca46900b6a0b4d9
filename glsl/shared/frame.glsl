// Set 0: the frame and the scene, the same for every pass (Rust: render::FrameConstants,
// scene::Vertex, …).
#ifndef LUMIVOX_FRAME
#define LUMIVOX_FRAME

layout(std140, set = 0, binding = 0) uniform FrameConstants {
    mat4 clip_from_world;
    vec4 eye_ws;              // xyz: camera position [m]
    vec4 ray_right;           // xyz: from the image's centre to its right edge at view depth 1
    vec4 ray_up;              // xyz: from the image's centre to its top edge at view depth 1
    vec4 ray_forward;         // xyz: unit view direction
    vec4 environment;         // rgb: radiance [W/(m² sr)]; w: 1 where it is times a map
    // where there is a map: cosine and sine of its turn, edges of its first and last levels
    vec4 sky;
    uvec4 size_px;            // xy: image size [px]; z: number of lights; w: of light views
    uvec4 walk;               // x: number of the frame, for patterns that change with it
    uvec4 gathered;           // which pixels are gathered (shared/receiver.glsl)
} frame;

layout(set = 0, binding = 1) uniform sampler linear_clamp;
layout(set = 0, binding = 2) uniform sampler nearest_clamp;
layout(set = 0, binding = 3) uniform sampler linear_repeat;

struct Material {
    vec4 albedo;              // rgb: diffuse albedo; w: 1 where there is a mask texture
    vec4 emission;            // rgb: emitted radiance [W/(m² sr)]; w: 1 where there is a normal map
    vec4 specular;            // rgb: F0; w: roughness, negative where there is no lobe
    vec4 metalness;           // x: metalness; y: 1 where the lobe has a texture
};

struct Light {
    vec4 position_kind;       // xyz: position [m]; w: 0 directional, 1 point, 2 spot
    vec4 direction_inner; // xyz: direction of travel; w: inner half angle [rad]
    vec4 power_outer;     // rgb: irradiance [W/m²] or intensity [W/sr]; w: outer half angle [rad]
    // x: first light view for lookups anywhere; y: their number; zw: the same for what is seen
    uvec4 views;
    // x: first row of its shadow of what is clear; y: rows along an edge of it; 0: it has none
    uvec4 clear;
};

// Several buffers, since the size of one binding is limited and most passes read positions alone.
// A vec3 in an array would take the room of four numbers.
layout(std430, set = 0, binding = 4) readonly buffer Positions { float positions[]; };   // [m]
layout(std430, set = 0, binding = 5) readonly buffer ShadingNormals { float shading_normals[]; };
layout(std430, set = 0, binding = 6) readonly buffer Uvs { vec2 uvs[]; };   // v upwards
layout(std430, set = 0, binding = 7) readonly buffer TriangleVertices {
    uint triangle_vertices[];
};
layout(std430, set = 0, binding = 8) readonly buffer TriangleMaterials {
    uint triangle_materials[];
};
layout(std430, set = 0, binding = 9) readonly buffer Materials { Material materials[]; };
layout(std430, set = 0, binding = 10) readonly buffer Lights { Light lights[]; };

const float PI = 3.14159265358979;

// Radiance that comes from everywhere alike [W/(m² sr)]: none where there is a map.
vec3 uniform_environment() { return (1.0 - frame.environment.w) * frame.environment.rgb; }

// The vertices of a triangle, counter-clockwise from the front.
uvec3 vertices_of(uint triangle) {
    uint first = 3u * triangle;
    return uvec3(triangle_vertices[first], triangle_vertices[first + 1u],
        triangle_vertices[first + 2u]);
}

// Draws by indices go through corners: corner number i is the first of triangle i, which brings
// what the whole triangle shares; further corners are those of vertices that are first nowhere
// (Rust: render::corners).
uint vertex_of_corner(uint corner) { return triangle_vertices[3u * corner]; }

// Position of a vertex [m].
vec3 position_of(uint vertex) {
    uint first = 3u * vertex;
    return vec3(positions[first], positions[first + 1u], positions[first + 2u]);
}

// Unit shading normal of a vertex.
vec3 shading_normal_of(uint vertex) {
    uint first = 3u * vertex;
    return vec3(shading_normals[first], shading_normals[first + 1u], shading_normals[first + 2u]);
}

// Texture coordinates of a vertex in Vulkan's orientation: v downwards.
vec2 texture_uv(uint vertex) {
    return vec2(uvs[vertex].x, 1.0 - uvs[vertex].y);
}

// From the eye through the centre of a pixel, up to view depth 1.
vec3 pixel_ray(ivec2 pixel) {
    vec2 ndc = (vec2(pixel) + 0.5) / vec2(frame.size_px.xy) * 2.0 - 1.0;
    return frame.ray_forward.xyz + ndc.x * frame.ray_right.xyz - ndc.y * frame.ray_up.xyz;
}

// Position [m] of the surface at view depth `depth_m` through the centre of a pixel.
vec3 position_from_depth(ivec2 pixel, float depth_m) {
    return frame.eye_ws.xyz + depth_m * pixel_ray(pixel);
}

#endif
