#version 460
#extension GL_GOOGLE_include_directive : require
// clear.enter: what thin sheets leave of the light of each pixel's surface, and where its ray goes
// on from the first body in front of that.
layout(local_size_x = 8, local_size_y = 8) in;

#define FIRST_BINDING 5
#define ASKED writeonly

#include "render/bvh/bindings.glsl"

layout(set = 1, binding = 8) uniform texture2D view_depth;
// rgb: what is left of the light of the pixel's surface; a: 1 behind something clear
layout(set = 1, binding = 9, rgba32f) uniform restrict writeonly image2D clear_filter;
// rgb: light that comes through bodies [W/(m² sr)]
layout(set = 1, binding = 10, rgba32f) uniform restrict writeonly image2D clear_light;

layout(push_constant) uniform EnterParams {
    uint is_mirrored;   // 1: from the first body, the mirrored ray instead of the refracted one
    uint has_bodies;    // 1 where some surface bends light
} params;

#include "shared/frame.glsl"
#include "render/clear/way.glsl"

// Sheets that a ray passes before the first body.
const uint MOST_SHEETS = 16u;

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, ivec2(frame.size_px.xy)))) return;
    uint index = uint(pixel.y) * frame.size_px.x + uint(pixel.x);
    float depth = texelFetch(sampler2D(view_depth, nearest_clamp), pixel, 0).r;
    vec3 ray = pixel_ray(pixel), direction = normalize(ray);
    float end = depth > 0.0 ? depth * length(ray) : infinite();
    vec3 origin = frame.eye_ws.xyz, left = vec3(1.0);
    uint leaves = NO_TRIANGLE;
    bool is_behind = false, meets_body = false;
    for (uint i = 0u; i < MOST_SHEETS && !meets_body; ++i) {
        RayHit hit = traverse(origin, direction, end, leaves, NO_TRIANGLE, false);
        if (hit.triangle == NO_TRIANGLE) break;
        is_behind = true;
        Interface met = interface_at(hit.triangle, hit.at, direction);
        leaves = hit.triangle;
        meets_body = !met.is_thin;
        if (meets_body) {
            aim(index, meet_body(met, direction, params.is_mirrored != 0u, left), leaves);
        } else {
            left *= met.passes;
            origin = leave(met, direction, true, left).origin;
            end -= hit.t;
        }
    }
    if (!meets_body && params.has_bodies != 0u) sight_rays[index].direction = vec4(0.0);
    if (params.is_mirrored == 0u) {
        imageStore(clear_filter, pixel,
            vec4(meets_body ? vec3(0.0) : left, is_behind ? 1.0 : 0.0));
        imageStore(clear_light, pixel, vec4(0.0));
    }
}
