#version 460
#extension GL_GOOGLE_include_directive : require
// cone.shadow: light reflected once, each light seen by a cone through the voxels. L = Σ (ρ/π +
// f_s) E (n·ω) V; alpha is 1 where there is a surface.
layout(local_size_x = 8, local_size_y = 8) in;

layout(set = 1, binding = 0) uniform texture2D view_depth;
layout(set = 1, binding = 1) uniform utexture2D normals;
layout(set = 1, binding = 2) uniform texture2D albedo;
layout(set = 1, binding = 3) uniform texture2D specular;
layout(set = 1, binding = 4, rgba32f) uniform restrict image2D direct;
#if defined(SVO)
layout(std430, set = 1, binding = 5) restrict readonly buffer Nodes { uint nodes[]; };
layout(set = 1, binding = 6) uniform texture3D bricks;
layout(set = 1, binding = 7) uniform texture3D normals_of_bricks;
#elif defined(CLIPMAP)
layout(std430, set = 1, binding = 5) restrict readonly buffer Levels { vec4 levels[]; };
layout(set = 1, binding = 6) uniform texture3D clipmap;
layout(set = 1, binding = 7) uniform texture3D top;
#else
layout(set = 1, binding = 5) uniform texture3D voxels;
layout(set = 1, binding = 6) uniform utexture3D matter;
layout(set = 1, binding = 7) uniform texture3D faces;
#endif

layout(push_constant) uniform ShadowConeParams {
    vec4 grid;             // xyz: smallest corner of the grid [m]; w: voxel size [m]
    float resolution;
    float step_factor;
    float opacity_exponent;
    float height_clamp;
    float start_offset;   // of the cones' origin along the geometric normal [texels read there]
    float tan_half;       // tan(γ/2)
    uint is_glossy;
    uint first_light;     // of this dispatch, which adds to what those before it left
    uint end_light;
    uint face_stride;     // bricks of a sparse volume from a face of a tile to the next
} params;

#define GLOSSY params.is_glossy
#include "shared/direct.glsl"
#include "gi/shared/cone/shadow.glsl"

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, ivec2(frame.size_px.xy)))) return;
    Reflector reflector;
    if (!read_reflector(pixel, reflector)) {
        imageStore(direct, pixel, vec4(0.0));
        return;
    }
    MarchSettings settings = MarchSettings(params.resolution, params.step_factor,
        params.opacity_exponent, params.height_clamp, 0.0, params.grid.w, 0.0);
    vec3 normal = reflector.surface.geometric_normal;
    vec3 receiver = (reflector.surface.position_ws - params.grid.xyz) / params.grid.w;
    float start_offset = params.start_offset * largest_texel(receiver);
    vec3 origin = receiver + start_offset * normal;
    vec3 radiance = params.first_light == 0u ? vec3(0.0) : imageLoad(direct, pixel).rgb;
    for (uint i = params.first_light; i < params.end_light; ++i) {
        vec3 to_light;
        float cosine, distance = 1e9;
        vec3 reflected = reflected_light(lights[i], reflector, to_light, cosine);
        if (cosine <= 0.0) continue;
        if (lights[i].position_kind.w != LIGHT_DIRECTIONAL) {
            vec3 offset = (lights[i].position_kind.xyz - params.grid.xyz) / params.grid.w - origin;
            distance = length(offset);
            to_light = offset / max(distance, 1e-6);
        }
        radiance += reflected
            * (cosine
                * cone_visibility(
                    origin, normal, start_offset, to_light, distance, params.tan_half, settings));
    }
    imageStore(direct, pixel, vec4(radiance, 1.0));
}
