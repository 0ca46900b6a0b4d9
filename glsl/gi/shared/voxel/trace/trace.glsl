// Exact rays through the occupied voxels (three-dimensional digital differential analyser,
// Amanatides & Woo 1987, over blocks of 4×4×4 and voxels).
#ifndef LUMIVOX_TRACE
#define LUMIVOX_TRACE

#include "gi/shared/voxel/grid.glsl"
#include "gi/shared/voxel/records.glsl"

// The including pass declares `occupancy`, `block_bases`, `voxel_records`.

struct TraceSettings {
    uint resolution;
    // a voxel whose surface lies lower than this over the receiver's tangent plane is the receiver
    // itself [voxels]
    float self_height;
    // a hit must meet the voxel's own plane ahead, within the voxel enlarged by this [voxels];
    // negative: any touched voxel is hit
    float contour_slack;
};

// Whether a ray that passes through the voxel hits the surface inside it.
bool hits_surface(uint slot, vec3 cell, vec3 origin, vec3 direction, vec3 receiver,
    vec3 receiver_normal, TraceSettings s) {
    Voxel voxel = voxel_records[slot];
    vec3 surface = cell + unpack_unorm10(voxel.mean_position);
    if (dot(surface - receiver, receiver_normal) < s.self_height) return false;
    if (s.contour_slack < 0.0) return true;
    vec3 normal = unpack_mean_normal(voxel.normal);
    if (dot(normal, normal) < 0.9) {
        // Several planes in one voxel are no plane: the whole voxel is hit, but by a ray that
        // leaves a corner from within the layers of its planes.
        vec3 off = mix(vec3(0.0), abs(origin - cell - 0.5), greaterThan(abs(normal), vec3(0.1)));
        bool outside = any(greaterThan(off, vec3(0.5 + s.contour_slack)));
        return outside || is_opposed(voxel) || !sees_back(voxel, direction);
    }
    float rate = dot(normal, direction);
    if (abs(rate) < 1e-3) return true;
    float along = dot(normal, surface - origin) / rate;
    // A ray that starts on the plane is in front of it.
    if (along < (rate > 0.0 ? s.contour_slack : -s.contour_slack)) return false;
    vec3 met = origin + direction * along - cell;
    return all(greaterThanEqual(met, vec3(-s.contour_slack)))
        && all(lessThanEqual(met, vec3(1.0 + s.contour_slack)));
}

// The cell after `cell` on a ray, whose direction has the reciprocal `inverse` and points up where
// `ahead` is 1; an empty block of 4³ is left as a whole (`size` 4). `distance` is where the ray
// leaves the cell [voxels].
ivec3 next_cell(ivec3 cell, int size, vec3 origin, vec3 direction, vec3 inverse, ivec3 ahead,
    out float distance) {
    ivec3 low = cell & ivec3(-size);
    vec3 leave = (vec3(low + ahead * size) - origin) * inverse;
    distance = min(leave.x, min(leave.y, leave.z));
    bvec3 crossed = lessThanEqual(leave, vec3(distance));
    ivec3 along = clamp(ivec3(floor(origin + direction * distance)), low, low + size - 1);
    return mix(along, mix(low - 1, low + size, greaterThan(ahead, ivec3(0))), crossed);
}

// Compact index of the first voxel hit, or −1; `distance` is where the ray enters it, or leaves the
// grid [voxels].
int trace(vec3 origin, vec3 direction, vec3 receiver, vec3 receiver_normal, TraceSettings s,
    out float distance) {
    direction = mix(direction, vec3(1e-20), lessThan(abs(direction), vec3(1e-20)));
    vec3 inverse = 1.0 / direction;
    ivec3 ahead = ivec3(greaterThan(direction, vec3(0.0)));
    ivec3 cell = ivec3(floor(origin));
    distance = 0.0;
    // Each turn leaves a cell for good, so the number of cells on a line bounds the loop.
    for (uint turn = 0u; turn < 4u * s.resolution; ++turn) {
        if (any(lessThan(cell, ivec3(0))) || any(greaterThanEqual(cell, ivec3(s.resolution))))
            return -1;
        uint block = block_index(uvec3(cell), s.resolution);
        uvec2 words = occupancy[block];
        int size = 4;
        if ((words.x | words.y) != 0u) {
            size = 1;
            uint bit = block_bit(uvec3(cell));
            if (block_has(words, bit)) {
                uint slot = block_bases[block] + set_bits_below(words, bit);
                if (hits_surface(slot, vec3(cell), origin, direction, receiver, receiver_normal, s))
                    return int(slot);
            }
        }
        cell = next_cell(cell, size, origin, direction, inverse, ahead, distance);
    }
    return -1;
}

// ν of a ray up to a distance: ν ← ν + (1 − ν) κ/t at each voxel that it hits, t being where it
// enters the voxel (Villegas & Ramírez, section VI-C). κ [voxels]; one hit nearer than κ is enough
// for ν = 1.
float soft_occlusion(vec3 origin, vec3 direction, vec3 receiver, vec3 receiver_normal,
    TraceSettings s, float reach, float kappa) {
    direction = mix(direction, vec3(1e-20), lessThan(abs(direction), vec3(1e-20)));
    vec3 inverse = 1.0 / direction;
    ivec3 ahead = ivec3(greaterThan(direction, vec3(0.0)));
    ivec3 cell = ivec3(floor(origin));
    float distance = 0.0, occlusion = 0.0;
    for (uint turn = 0u; turn < 4u * s.resolution && distance < reach && occlusion < 1.0; ++turn) {
        if (any(lessThan(cell, ivec3(0))) || any(greaterThanEqual(cell, ivec3(s.resolution))))
            break;
        uint block = block_index(uvec3(cell), s.resolution);
        uvec2 words = occupancy[block];
        int size = (words.x | words.y) == 0u ? 4 : 1;
        uint bit = block_bit(uvec3(cell));
        if (block_has(words, bit)) {
            uint slot = block_bases[block] + set_bits_below(words, bit);
            bool hit =
                hits_surface(slot, vec3(cell), origin, direction, receiver, receiver_normal, s);
            if (hit) occlusion += (1.0 - occlusion) * min(kappa / max(distance, 1e-6), 1.0);
        }
        cell = next_cell(cell, size, origin, direction, inverse, ahead, distance);
    }
    return occlusion;
}

#endif
