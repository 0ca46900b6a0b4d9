// cone.obscure: gathered light, multiplied by the least that the cones to the lights see of one
// (Kahl 2019, equation 5.9).
layout(local_size_x = 8, local_size_y = 8) in;

#define VOLUME_BINDING 4

layout(set = 1, binding = 0) uniform texture2D view_depth;
layout(set = 1, binding = 1) uniform utexture2D normals;
layout(set = 1, binding = 2, r32f) uniform restrict image2D least_visibility;
layout(set = 1, binding = 3, rgba32f) uniform restrict image2D indirect_diffuse;

#include "gi/shared/cone/march_settings.glsl"

layout(push_constant) uniform ObscureParams {
    vec4 grid;             // xyz: smallest corner of the grid [m]; w: voxel size [m]
    MarchSettings march;
    float tan_half;        // tan(γ/2)
    uint first_light;      // of this dispatch, which goes on from what those before it left
    uint end_light;
    uint is_last;          // 1: of the dispatches
    uint face_stride;      // of the volume: from a face of what it stores to the next
} params;

#include "shared/receiver.glsl"
#include "gi/shared/cone/light_cone.glsl"

void main() {
    ivec2 texel = ivec2(gl_GlobalInvocationID.xy);
    if (!is_gathered(texel)) return;
    Surface surface;
    if (!read_receiver(texel, surface)) return;
    MarchSettings settings = params.march;
    vec3 normal = surface.geometric_normal;
    vec3 receiver = (surface.position_ws - params.grid.xyz) / params.grid.w;
    float start_offset = settings.start_offset * largest_texel(receiver);
    vec3 origin = receiver + start_offset * normal;
    float least = params.first_light == 0u ? 1.0 : imageLoad(least_visibility, texel).r;
    for (uint i = params.first_light; i < params.end_light; ++i) {
        vec3 to_light;
        light_irradiance(lights[i], surface.position_ws, to_light);
        // A light behind the surface is not hidden from it by anything else.
        if (dot(normal, to_light) <= 0.0) continue;
        least = min(least,
            light_visibility(
                lights[i], origin, normal, start_offset, to_light, params.tan_half, settings));
    }
    if (params.is_last != 0u) {
        vec4 gathered = imageLoad(indirect_diffuse, texel);
        imageStore(indirect_diffuse, texel, vec4(least * gathered.rgb, gathered.a));
    } else {
        imageStore(least_visibility, texel, vec4(least));
    }
}
