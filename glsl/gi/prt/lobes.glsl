// The radiance above points, and tables of what lobes make of its harmonics (Rust: prt::lobes).
#ifndef LUMIVOX_PRT_LOBES
#define LUMIVOX_PRT_LOBES

#include "gi/prt/lattice.glsl"
#include "shared/packing.glsl"

layout(constant_id = 0) const uint ORDER = 5;   // bands

layout(set = 1, binding = 2) uniform utexture2D cells;
// rgb: a coefficient of a point [W/(m² sr)], then the next of the same point
layout(std430, set = 1, binding = 3) restrict readonly buffer PointLobes { vec4 point_lobes[]; };
// x and z axes of the frame of each point's coefficients
layout(std430, set = 1, binding = 4) restrict readonly buffer PointFrames { vec4 point_frames[]; };
// a row of harmonics with m ≥ 0 for each entry, m by m; x: factor of F₀, y: besides
layout(std430, set = 1, binding = 5) restrict readonly buffer LobeTable { vec2 lobe_table[]; };

const uint TABLE_EDGE = 32u;
const uint TABLE_TERMS = ORDER * (ORDER + 1u) / 2u;

// Where the table has an angle with this cosine.
float angle_place(float cosine) {
    return acos(clamp(cosine, 0.0, 1.0)) / 1.57079632679489662 * float(TABLE_EDGE - 1u);
}

// The points around a pixel, and a direction in the frame of each: cosine and sine of its azimuth.
struct Lobes {
    uvec3 points;
    vec3 shares;
    vec2 azimuths[3];
};

// False where the pixel shows no points. Each has a frame of its own: where a surface is bent, the
// direction turns with its normal.
bool lobes_of(uvec4 cell, vec3 normal, vec3 direction, out Lobes lobes) {
    if (cell.x == 0u) return false;
    bool is_front = (cell.x & 1u) == 1u;
    if (!points_around((cell.x - 1u) / 2u, is_front, uintBitsToFloat(cell.yz), lobes.points,
            lobes.shares))
        return false;
    for (int i = 0; i < 3; ++i) {
        uint first = 2u * lobes.points[i];
        vec3 x = point_frames[first].xyz, z = point_frames[first + 1u].xyz, way = direction;
        vec3 axis = cross(normal, z);
        float cosine = dot(normal, z);
        // The least turn that takes one normal to the other (Rodrigues).
        if (cosine > -0.99)
            way = cosine * way + cross(axis, way) + axis * dot(axis, way) / (1.0 + cosine);
        vec2 flat_way = vec2(dot(way, x), dot(way, cross(z, x)));
        float size = length(flat_way);
        lobes.azimuths[i] = size > 1e-4 ? flat_way / size : vec2(1.0, 0.0);
    }
    return true;
}

// Of a harmonic with m ≥ 0 and its twin, what points around a pixel have in a direction's azimuth.
vec3 radiance_of(Lobes lobes, vec2 turns[3], uint l, uint m) {
    vec3 sum = vec3(0.0);
    for (int i = 0; i < 3; ++i) {
        uint middle = lobes.points[i] * ORDER * ORDER + l * l + l;
        vec3 own = turns[i].x * point_lobes[middle + m].rgb;
        if (m > 0u) own += turns[i].y * point_lobes[middle - m].rgb;
        sum += lobes.shares[i] * own;
    }
    return sum;
}

// What is seen of points through a lobe: shares of four entries of the table. Azimuths turn from m
// to m + 1.
vec3 seen_through(Lobes lobes, vec3 f0, uvec4 entries, vec4 shares) {
    vec3 sum = vec3(0.0);
    vec2 turns[3] = vec2[](vec2(1.0, 0.0), vec2(1.0, 0.0), vec2(1.0, 0.0));
    uvec4 words = entries * TABLE_TERMS;
    for (uint m = 0u; m < ORDER; ++m) {
        for (uint l = m; l < ORDER; ++l) {
            vec2 factors = shares.x * lobe_table[words.x] + shares.y * lobe_table[words.y]
                + shares.z * lobe_table[words.z] + shares.w * lobe_table[words.w];
            sum += (f0 * factors.x + factors.y) * radiance_of(lobes, turns, l, m);
            words += 1u;
        }
        for (int i = 0; i < 3; ++i) {
            vec2 turn = turns[i], own = lobes.azimuths[i];
            turns[i] = vec2(turn.x * own.x - turn.y * own.y, turn.y * own.x + turn.x * own.y);
        }
    }
    return sum;
}

#endif
