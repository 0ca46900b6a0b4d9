#version 460
#extension GL_GOOGLE_include_directive : require
// clear.pass: adds what was seen along the line of sight of each pixel, and sends on what met
// nothing up to the next clear surface.
layout(local_size_x = 8, local_size_y = 8) in;

#define FIRST_BINDING 5
#define ASKED

#include "render/bvh/bindings.glsl"
#include "shared/sight.glsl"

layout(std430, set = 1, binding = 8) restrict readonly buffer Sights { Sight sights[]; };
layout(set = 1, binding = 9, rgba32f) uniform restrict image2D clear_light;

#include "shared/environment.glsl"
#include "render/clear/way.glsl"

// Solid angle of a pixel in the middle of the picture [sr].
float pixel_angle() {
    return 4.0 * length(frame.ray_right.xyz) * length(frame.ray_up.xyz)
        / float(frame.size_px.x * frame.size_px.y);
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, ivec2(frame.size_px.xy)))) return;
    uint index = uint(pixel.y) * frame.size_px.x + uint(pixel.x);
    vec3 direction = sight_rays[index].direction.xyz;
    if (direction == vec3(0.0)) return;
    Way way = ways[index];
    vec4 seen = sights[index].light;
    vec3 light = way.left.rgb * seen.rgb, left = way.left.rgb * seen.a;
    uint triangle = floatBitsToUint(way.left.w);
    if (triangle == NO_TRIANGLE) {
        light += left * environment_around(direction, pixel_angle());
        sight_rays[index].direction = vec4(0.0);
    } else if (max(left.r, max(left.g, left.b)) < LEAST_LEFT) {
        sight_rays[index].direction = vec4(0.0);
    } else {
        Interface met = interface_at(triangle, way.at.xy, direction);
        Passed passed = met.is_thin ? leave(met, direction, true, met.passes * left)
                                    : meet_body(met, direction, false, left);
        aim(index, passed, triangle);
    }
    imageStore(clear_light, pixel, imageLoad(clear_light, pixel) + vec4(light, 0.0));
}
