#version 460
#extension GL_GOOGLE_include_directive : require
// voxel.running_average: the papers' moving average of albedo in an RGBA8 image, by
// compare-and-swap (Crassin & Green 2012, section 22.4.2). Rounded to 8 bits after every fragment
// and counted to 255 at most, it depends on the order of the fragments: here to be measured, not to
// be used.
layout(local_size_x = 64) in;

#include "gi/shared/voxel/records.glsl"

layout(std430, set = 1, binding = 0) restrict readonly buffer Fragments { Fragment fragments[]; };
// rgb: average, a: count / 255
layout(set = 1, binding = 1, r32ui) uniform coherent uimage3D averages;

layout(push_constant) uniform LinkParams {
    uint resolution;
    uint fragment_count;
    uint first_fragment;
}
params;

void main() {
    uint index = gl_GlobalInvocationID.x + gl_GlobalInvocationID.y * 4194240u;
    if (index >= params.fragment_count) return;
    vec3 albedo = unpack_albedo(fragments[index].normal_albedo.y);
    uvec2 place = fragments[index].place_area;
    ivec3 voxel = ivec3(voxel_coordinates(place.x, place.y));
    uint expected = 0u, stored = packUnorm4x8(vec4(albedo, 1.0 / 255.0));
    for (;;) {
        uint found = imageAtomicCompSwap(averages, voxel, expected, stored);
        if (found == expected) break;
        expected = found;
        vec4 average = unpackUnorm4x8(found);
        float count = round(average.a * 255.0);
        stored = packUnorm4x8(
            vec4((average.rgb * count + albedo) / (count + 1.0), min(count + 1.0, 255.0) / 255.0));
    }
}
