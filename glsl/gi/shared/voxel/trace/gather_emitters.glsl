// voxel.gather_emitters: adds the light of surfaces that emit to the diffuse irradiance, by rays to
// points of them, E = 1/n Σ L cos θ cos θ' V / (d² p).
layout(local_size_x = 8, local_size_y = 8) in;

#define PARTS_BINDING 0
#include "gi/shared/voxel/trace/emitters.glsl"
#include "gi/shared/voxel/trace/hides_point.glsl"

layout(set = 1, binding = 1) uniform texture2D view_depth;
layout(set = 1, binding = 2) uniform utexture2D normals;
layout(set = 1, binding = 3, rgba32f) uniform restrict image2D indirect_diffuse;

#include "gi/shared/voxel/trace/ray_params.glsl"
#include "shared/receiver.glsl"
#include "shared/directions.glsl"

void main() {
    ivec2 texel = ivec2(gl_GlobalInvocationID.xy);
    if (!is_gathered(texel)) return;
    Surface surface;
    if (!read_receiver(texel, surface)) return;
    ivec2 place = place_of(texel);
    TraceSettings settings = TraceSettings(params.resolution, params.self_height,
        params.contour_slack, seed_of(uvec3(place, 0), frame.walk.x), 0u);
    vec3 receiver = (surface.position_ws - params.grid.xyz) / params.grid.w;
    vec3 origin = receiver + params.start_offset * voxel_edge(receiver) * surface.geometric_normal;
    vec2 offset = interleaved_offset(place, params.pattern, frame.walk.x);
    vec3 irradiance = vec3(0.0);
    for (uint i = params.first_ray; i < params.end_ray; ++i) {
        EmitterPoint seen = ray_point(i, params.ray_count, offset, params.part_count,
            surface.position_ws, surface.shading_normal, surface.geometric_normal, 0.0);
        if (seen.irradiance == vec3(0.0)) continue;
        settings.ray = i;
        vec3 point = (seen.position - params.grid.xyz) / params.grid.w;
        if (!hides_point(
                origin, point, seen.normal, receiver, surface.geometric_normal, settings))
            irradiance += seen.irradiance;
    }
    vec4 before = imageLoad(indirect_diffuse, texel);
    imageStore(
        indirect_diffuse, texel, before + vec4(irradiance / float(params.ray_count), 0.0));
}
