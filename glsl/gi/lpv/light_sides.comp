#version 460
#extension GL_GOOGLE_include_directive : require
// lpv.light_sides: what opaque faces send into their cells, L = L_e + ρ/π (E_direct + E_before):
// direct light by shadow maps, and what the sweep before has brought to the cell.
layout(local_size_x = 64) in;

#include "shared/light_view.glsl"
#include "gi/lpv/grid.glsl"
#include "gi/lpv/sides.glsl"
#include "gi/lpv/changes.glsl"

layout(constant_id = 0) const bool DIRECT = false;   // with direct light
layout(constant_id = 1) const bool AGAIN = false;    // with what the sweep before has brought
layout(constant_id = 2) const bool COMPARE = false;  // with what was sent in the bounce before
layout(constant_id = 3) const bool HAS_BAND2 = true;

layout(std430, set = 1, binding = 0) restrict readonly buffer LightViews {
    LightView light_views[];
};
layout(set = 1, binding = 1) uniform texture2DArray shadow_maps;
layout(std430, set = 1, binding = 2) restrict readonly buffer Sides { Side sides[]; };
layout(set = 1, binding = 3) uniform texture3D light;
layout(set = 1, binding = 4) uniform texture3D light_band2;
layout(std430, set = 1, binding = 5) restrict buffer SideLight {
    vec4 side_light[];   // rgb: in steps of the scale; w: 0
};

layout(std430, set = 1, binding = 6) restrict writeonly buffer Changes {
    uvec4 changes[];   // of each workgroup: Σ|change|, Σ, over red, green and blue
};

layout(push_constant) uniform SideParams {
    CellGrid grid;
    uint side_count;
    float scale;   // radiance of a stored 1 [W/(m² sr)]
} params;

#include "shared/visibility.glsl"
#include "gi/lpv/fetch_light.glsl"

vec3 direct_irradiance(Side side) {
    vec3 sum = vec3(0.0), to_light;
    for (uint i = 0u; i < frame.size_px.z; ++i) {
        vec3 arriving = light_irradiance(lights[i], side.place.xyz, to_light);
        float cosine = dot(side.normal.xyz, to_light);
        if (cosine > 0.0)
            sum += arriving
                * (cosine * light_visibility(
                        lights[i], side.place.xyz, side.normal.xyz, 0.0, true));
    }
    return sum;
}

vec3 irradiance_before(Side side) {
    ivec3 cell = cell_at(params.grid, floatBitsToInt(side.place.w));
    vec4 found = irradiance(fetch_light_of(params.grid, cell), side.normal.xyz);
    return params.scale * found.rgb + found.a * uniform_environment();
}

shared uvec4 sums[64];

// How much the sides of the workgroup have changed.
void note_change(vec2 change) {
    uint own = gl_LocalInvocationID.x;
    sums[own] = change_in_steps(change);
    barrier();
    for (uint half_count = 32u; half_count > 0u; half_count /= 2u) {
        if (own < half_count) sums[own] = sum_of(sums[own], sums[own + half_count]);
        barrier();
    }
    if (own == 0u) changes[gl_WorkGroupID.x] = sums[0];
}

void main() {
    uint index = gl_GlobalInvocationID.x;
    vec2 change = vec2(0.0);
    if (index < params.side_count) {
        Side side = sides[index];
        vec3 sum = vec3(0.0);
        if (DIRECT) sum += direct_irradiance(side);
        if (AGAIN) sum += irradiance_before(side);
        vec3 radiance = (side.emission.rgb + side.albedo.rgb * sum / PI) / params.scale;
        if (COMPARE)
            change = vec2(
                dot(abs(radiance - side_light[index].rgb), vec3(1.0)), dot(radiance, vec3(1.0)));
        side_light[index] = vec4(radiance, 0.0);
    }
    if (COMPARE) note_change(change);
}
