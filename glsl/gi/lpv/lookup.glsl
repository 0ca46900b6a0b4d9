// What arrives off a surface. The including pass declares `light` and `light_band2`
// (gi/lpv/light.glsl), and includes shared/gbuffer.glsl before.
#ifndef LUMIVOX_LPV_LOOKUP
#define LUMIVOX_LPV_LOOKUP

#include "gi/lpv/light.glsl"

layout(constant_id = 0) const uint LEVELS = 1u;   // nested grids, each in its slab along z
layout(constant_id = 1) const bool NESTED = false;   // there are several
layout(constant_id = 2) const bool MASKED = false;   // no light of cells behind the surface
layout(constant_id = 3) const bool DAMPING = false;  // of light that falls off from the surface
layout(constant_id = 4) const bool HAS_BAND2 = true;

layout(push_constant) uniform LookupParams {
    CellGrid grid;   // the outermost
    uvec4 inner;     // where each inner grid is from the first cell of the one around it [its own
                     // cells], 10 bits an axis
    float shift;     // off the surface [cells]
    float scale;     // radiance of a stored 1 [W/(m² sr)]
    float blend;     // cells over which a grid goes over into the one around it
} params;

#include "gi/lpv/corners.glsl"

// The light of some cells.
void fetch_corners(Corners corners, uint level, out vec4 found[COEFFICIENTS]) {
    ivec3 size = params.grid.size.xyz;
    for (int i = 0; i < COEFFICIENTS; ++i) {
        ivec3 block = (light_block(i) + ivec3(0, 0, level)) * size;
        vec4 sum = vec4(0.0);
        for (int at = 0; at < 8; ++at) {
            ivec3 texel = block + corners.cells[at];
            if (i < LOW_COEFFICIENTS)
                sum += corners.weights[at] * texelFetch(sampler3D(light, nearest_clamp), texel, 0);
            else if (HAS_BAND2)
                sum += corners.weights[at]
                    * texelFetch(sampler3D(light_band2, nearest_clamp), texel, 0);
        }
        found[i] = sum * vec4(vec3(params.scale), 1.0);
    }
}

// The light off a surface at a place of a grid [cells].
void fetch_light(vec3 place, vec3 normal, float shift, uint level, out vec4 found[COEFFICIENTS]) {
    vec3 position = shifted(place, normal, shift), size = vec3(params.grid.size.xyz);
    if (MASKED) {
        fetch_corners(corners_around(position, place, normal, true), level, found);
        return;
    }
    // The blocks lie side by side: half a cell from a block's border the filter stays inside.
    position = clamp(position, vec3(0.5), size - 0.5) + vec3(0.0, 0.0, float(level) * size.z);
    for (int i = 0; i < COEFFICIENTS; ++i) {
        vec3 texel = position + vec3(light_block(i)) * size;
        vec4 sum = vec4(0.0);
        if (i < LOW_COEFFICIENTS)
            sum = textureLod(
                sampler3D(light, linear_clamp), texel / (size * vec3(2, 2, LEVELS)), 0.0);
        else if (HAS_BAND2)
            sum = textureLod(
                sampler3D(light_band2, linear_clamp), texel / (size * vec3(5, 1, LEVELS)), 0.0);
        found[i] = sum * vec4(vec3(params.scale), 1.0);
    }
}

// From the finest grid outwards, until all is told.
void look_up_nested(Surface surface, float shift, out vec4 coefficients[COEFFICIENTS]) {
    vec3 places[LEVELS], lattice = to_lattice(params.grid, surface.position_ws);
    ivec3 first = params.grid.first.xyz;
    for (uint level = 0u; level < LEVELS; ++level) {
        if (level > 0u) {
            uint inner = params.inner[level - 1u];
            first = 2 * first + ivec3(inner & 1023u, inner >> 10 & 1023u, inner >> 20);
            lattice *= 2.0;
        }
        places[level] = lattice - vec3(first);
    }
    for (int i = 0; i < COEFFICIENTS; ++i) coefficients[i] = vec4(0.0);
    vec3 middle = 0.5 * vec3(params.grid.size.xyz);
    float left = 1.0;
    for (uint level = LEVELS; level-- > 0u && left > 0.0;) {
        vec3 position = shifted(places[level], surface.geometric_normal, shift);
        vec3 inside = middle - 0.5 - abs(position - middle);
        float reach = min(inside.x, min(inside.y, inside.z)), share = float(reach >= 0.0);
        if (params.blend > 0.0) share = clamp(reach / params.blend, 0.0, 1.0);
        if (level == 0u) share = 1.0;
        if (share == 0.0) continue;
        vec4 found[COEFFICIENTS];
        fetch_light(places[level], surface.geometric_normal, shift, level, found);
        for (int i = 0; i < COEFFICIENTS; ++i) coefficients[i] += left * share * found[i];
        left *= 1.0 - share;
    }
}

void look_up_off(Surface surface, float shift, out vec4 coefficients[COEFFICIENTS]) {
    if (NESTED) {
        look_up_nested(surface, shift, coefficients);
        return;
    }
    vec3 place = to_cells(params.grid, surface.position_ws);
    fetch_light(place, surface.geometric_normal, shift, 0u, coefficients);
}

// Light that changes along the normal against itself, as it does where it comes through the wall:
// times 1 + ⟨c, ∂c/∂n⟩/⟨c, c⟩ between 0 and 1, the derivative being a difference over one cell.
void damp(Surface surface, inout vec4 coefficients[COEFFICIENTS]) {
    vec4 front[COEFFICIENTS], behind[COEFFICIENTS];
    look_up_off(surface, params.shift + 0.5, front);
    look_up_off(surface, params.shift - 0.5, behind);
    vec4 unit = vec4(1e-37), along = vec4(0.0), square = vec4(0.0);
    for (int i = 0; i < COEFFICIENTS; ++i) unit = max(unit, abs(coefficients[i]));
    for (int i = 0; i < COEFFICIENTS; ++i) {
        vec4 own = coefficients[i] / unit;
        along += own * ((front[i] - behind[i]) / unit);
        square += own * own;
    }
    vec4 factor = clamp(1.0 + along / max(square, vec4(1e-20)), 0.0, 1.0);
    for (int i = 0; i < COEFFICIENTS; ++i) coefficients[i] *= factor;
}

void look_up(Surface surface, out vec4 coefficients[COEFFICIENTS]) {
    look_up_off(surface, params.shift, coefficients);
    if (DAMPING) damp(surface, coefficients);
}

#endif
