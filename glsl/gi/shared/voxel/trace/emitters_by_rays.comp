#version 460
#extension GL_GOOGLE_include_directive : require
// voxel.gather_emitters_triangles: adds the light of surfaces that emit to the diffuse irradiance,
// as voxel.gather_emitters does, by rays against the scene's own triangles.
layout(local_size_x = 8, local_size_y = 8) in;

#include "render/bvh/bindings.glsl"
#define PARTS_BINDING 5
#include "gi/shared/voxel/trace/emitters.glsl"

layout(set = 1, binding = 6) uniform texture2D view_depth;
layout(set = 1, binding = 7) uniform utexture2D normals;
layout(set = 1, binding = 8, rgba32f) uniform restrict image2D indirect_diffuse;

#include "gi/shared/voxel/trace/ray_params.glsl"
#include "shared/receiver.glsl"
#include "shared/directions.glsl"
#include "render/bvh/start.glsl"
#include "render/bvh/traverse.glsl"

void main() {
    ivec2 texel = ivec2(gl_GlobalInvocationID.xy);
    if (!is_gathered(texel)) return;
    Surface surface;
    if (!read_receiver(texel, surface)) return;
    vec3 position = surface.position_ws, normal = surface.geometric_normal;
    float off = start_distance(position);
    vec3 origin = position + off * normal;
    vec2 offset = interleaved_offset(place_of(texel), params.pattern, frame.walk.x);
    vec3 irradiance = vec3(0.0);
    for (uint i = params.first_ray; i < params.end_ray; ++i) {
        EmitterPoint seen = ray_point(i, params.ray_count, offset, params.part_count, position,
            surface.shading_normal, normal, 0.0);
        if (seen.irradiance == vec3(0.0)) continue;
        vec3 way = seen.position - origin;
        float reach = length(way);
        // The point's own triangle ends the ray, and is as far off as it is rounded.
        if (reach <= off
            || !is_occluded(origin, way / reach, reach - off, NO_TRIANGLE, NO_TRIANGLE))
            irradiance += seen.irradiance;
    }
    vec4 before = imageLoad(indirect_diffuse, texel);
    imageStore(
        indirect_diffuse, texel, before + vec4(irradiance / float(params.ray_count), 0.0));
}
