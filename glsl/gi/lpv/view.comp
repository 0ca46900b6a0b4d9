#version 460
#extension GL_GOOGLE_include_directive : require
// lpv.view: opaque faces as the camera sees them, by the irradiance that their cells bring them
// [W/m²]. A pixel's ray goes from cell to cell (Amanatides & Woo 1987). With LOBES, a cell beside
// an opaque face is in front of it as a lobe: in each direction as far from the cell's centre as a
// receiver that faces there gets irradiance, which is its colour.
layout(local_size_x = 8, local_size_y = 8) in;

layout(std430, set = 1, binding = 0) restrict readonly buffer Faces { uint faces[]; };
layout(set = 1, binding = 1) uniform texture3D light;
layout(set = 1, binding = 2) uniform texture3D light_band2;
layout(set = 1, binding = 3, rgba32f) uniform restrict writeonly image2D seen;

layout(constant_id = 0) const bool LOBES = false;
layout(constant_id = 1) const bool HAS_BAND2 = true;

#include "shared/frame.glsl"
#include "gi/lpv/fetch_light.glsl"

layout(push_constant) uniform ViewParams {
    CellGrid grid;
    float scale;   // radiance of a stored 1 [W/(m² sr)]
} params;

// No lobe reaches farther from the centre of its cell [cells].
const float REACH = 0.48;
// Nor is it nearer to the camera [cells].
const float NEAREST_LOBE = 2.0;
// Of a ray through a lobe's sphere, and halvings of the one in which it meets the lobe.
const int STEPS = 32, HALVINGS = 6;

vec4 irradiance_of(vec4 coefficients[COEFFICIENTS], vec3 normal) {
    vec4 found = irradiance(coefficients, normal);
    return vec4(params.scale * found.rgb + found.a * uniform_environment(), found.a / PI);
}

// The luminance of each coefficient of irradiance.
float[COEFFICIENTS] luminance_of(vec4 coefficients[COEFFICIENTS]) {
    float found[COEFFICIENTS];
    for (int i = 0; i < COEFFICIENTS; ++i) {
        vec4 c = coefficients[i];
        vec3 rgb = params.scale * c.rgb + c.a * uniform_environment();
        found[i] = SH_COSINE[band_of(i)] * dot(rgb, vec3(0.2126, 0.7152, 0.0722));
    }
    return found;
}

// No direction has a larger sum: of a band, √((2l + 1)/4π) times the length of its coefficients.
float bound(float coefficients[COEFFICIENTS]) {
    float squares[3] = float[](0.0, 0.0, 0.0);
    for (int i = 0; i < COEFFICIENTS; ++i)
        squares[band_of(i)] += coefficients[i] * coefficients[i];
    return (sqrt(squares[0]) + sqrt(3.0 * squares[1]) + sqrt(5.0 * squares[2])) * SH_Y0;
}

// Whether a place, off the centre of its cell [cells], is in the cell's lobe.
bool is_in_lobe(vec3 place, float coefficients[COEFFICIENTS], float largest) {
    float off = length(place);
    float basis[COEFFICIENTS] = sh_evaluate3(place / max(off, 1e-6));
    float sum = 0.0;
    for (int i = 0; i < COEFFICIENTS; ++i)
        sum += basis[i] * coefficients[i];
    return off * largest < REACH * sum;
}

// The irradiance where a ray meets the lobe of a cell; false where it does not.
bool meets_lobe(ivec3 cell, vec3 origin, vec3 direction, out vec4 found) {
    found = vec4(0.0);
    vec3 from = origin - (vec3(cell) + 0.5);
    float nearest = -dot(from, direction);
    float half_chord = REACH * REACH - dot(from, from) + nearest * nearest;
    if (half_chord <= 0.0) return false;
    half_chord = sqrt(half_chord);
    vec4 coefficients[COEFFICIENTS] = fetch_light_of(params.grid, cell);
    float luminances[COEFFICIENTS] = luminance_of(coefficients);
    float largest = bound(luminances);
    if (largest <= 0.0) return false;
    float width = 2.0 * half_chord / float(STEPS), t = nearest - half_chord;
    for (int i = 0; i < STEPS; ++i) {
        t += width;
        if (is_in_lobe(from + t * direction, luminances, largest)) {
            for (int halving = 0; halving < HALVINGS; ++halving) {
                width *= 0.5;
                bool is_in = is_in_lobe(from + (t - width) * direction, luminances, largest);
                t -= is_in ? width : 0.0;
            }
            found = irradiance_of(coefficients, normalize(from + t * direction));
            return true;
        }
    }
    return false;
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
            uint word = faces[cell_index(params.grid, cell)];
            // Cells around the camera hide nothing.
            bool has_lobe = LOBES && (word & FACE_BITS) != 0u
                && distance(vec3(cell) + 0.5, origin) > NEAREST_LOBE;
            if (has_lobe && meets_lobe(cell, origin, direction, result)) break;
            if ((word >> face & 1u) != 0u) {
                vec3 normal = vec3(0.0);
                normal[axis] = -float(steps[axis]);
                result = irradiance_of(fetch_light_of(params.grid, cell), normal);
                break;
            }
            cell[axis] += steps[axis];
        }
    }
    imageStore(seen, pixel, result);
}
