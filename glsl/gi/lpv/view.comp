#version 460
#extension GL_GOOGLE_include_directive : require
// lpv.view: opaque faces as the camera sees them, by the irradiance that their cells bring them
// [W/m²]. A pixel's ray goes from cell to cell (Amanatides & Woo 1987).
layout(local_size_x = 8, local_size_y = 8) in;

layout(std430, set = 1, binding = 0) restrict readonly buffer Faces { uint faces[]; };
layout(set = 1, binding = 1) uniform texture3D light;
layout(set = 1, binding = 2, rgba32f) uniform restrict writeonly image2D seen;

#include "shared/frame.glsl"
#include "gi/lpv/grid.glsl"
#include "gi/lpv/harmonics.glsl"

layout(push_constant) uniform ViewParams {
    CellGrid grid;
    float scale;   // radiance of a stored 1 [W/(m² sr)]
} params;

vec4 irradiance_of(ivec3 cell, vec3 normal) {
    vec4 coefficients[COEFFICIENTS];
    for (int i = 0; i < COEFFICIENTS; ++i)
        coefficients[i] = texelFetch(
            sampler3D(light, nearest_clamp), light_texel(params.grid, cell, i), 0);
    vec4 found = irradiance(coefficients, normal);
    return vec4(params.scale * found.rgb + found.a * frame.environment.rgb, found.a / PI);
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, ivec2(frame.size_px.xy)))) return;
    vec3 size = vec3(params.grid.size.xyz);
    vec3 origin = to_cells(params.grid, frame.eye_ws.xyz);
    vec3 direction = normalize(position_from_depth(pixel, 1.0) - frame.eye_ws.xyz);
    direction = mix(direction, vec3(1e-20), equal(direction, vec3(0.0)));
    bvec3 is_forward = greaterThan(direction, vec3(0.0));
    vec3 into = (mix(size, vec3(0.0), is_forward) - origin) / direction,
         out_of = (mix(vec3(0.0), size, is_forward) - origin) / direction;
    float entry = max(max(into.x, max(into.y, into.z)), 0.0);
    vec4 result = vec4(0.0);
    if (entry < min(out_of.x, min(out_of.y, out_of.z))) {
        ivec3 cell = clamp(
            ivec3(floor(origin + entry * direction)), ivec3(0), params.grid.size.xyz - 1);
        ivec3 steps = mix(ivec3(-1), ivec3(1), is_forward);
        while (is_inside(params.grid, cell)) {
            vec3 ends = (vec3(cell) + mix(vec3(0.0), vec3(1.0), is_forward) - origin) / direction;
            int axis = ends.x <= ends.y && ends.x <= ends.z ? 0 : ends.y <= ends.z ? 1 : 2;
            uint face = 2u * uint(axis) + uint(is_forward[axis]);
            if ((faces[cell_index(params.grid, cell)] >> face & 1u) != 0u) {
                vec3 normal = vec3(0.0);
                normal[axis] = -float(steps[axis]);
                result = irradiance_of(cell, normal);
                break;
            }
            cell[axis] += steps[axis];
        }
    }
    imageStore(seen, pixel, result);
}
