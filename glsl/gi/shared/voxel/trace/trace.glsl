// Exact rays through the voxels of a space (three-dimensional digital differential analyser,
// Amanatides & Woo 1987, over cells of any size).
#ifndef LUMIVOX_TRACE
#define LUMIVOX_TRACE

#include "gi/shared/voxel/trace/space.glsl"

struct TraceSettings {
    uint resolution;       // edge of the space
    // a voxel whose surface lies lower than this over the receiver's tangent plane is the receiver
    // itself [edges of the voxel]
    float self_height;
    // a hit must meet the voxel's own plane ahead, within the voxel enlarged by this [edges of the
    // voxel]; negative: any touched voxel is hit
    float contour_slack;
};

// Whether a ray that passes through a voxel hits the surface inside it.
bool hits_surface(SpaceCell cell, vec3 corner, vec3 origin, vec3 direction, vec3 receiver,
    vec3 receiver_normal, TraceSettings s) {
    Voxel voxel = surface_of(uint(cell.slot));
    float edge = float(cell.edge), slack = edge * s.contour_slack;
    vec3 surface = corner + edge * unpack_unorm10(voxel.mean_position);
    if (dot(surface - receiver, receiver_normal) < edge * s.self_height) return false;
    if (slack < 0.0) return true;
    vec3 normal = unpack_mean_normal(voxel.normal);
    if (dot(normal, normal) < 0.9) {
        // Several planes in one voxel are no plane: the whole voxel is hit, but by a ray that
        // leaves a corner from within the layers of its planes.
        vec3 off = mix(
            vec3(0.0), abs(origin - corner - 0.5 * edge), greaterThan(abs(normal), vec3(0.1)));
        bool outside = any(greaterThan(off, vec3(0.5 * edge + slack)));
        return outside || is_opposed(voxel) || !sees_back(voxel, direction);
    }
    float rate = dot(normal, direction);
    if (abs(rate) < 1e-3) return true;
    float along = dot(normal, surface - origin) / rate;
    // A ray that starts on the plane is in front of it.
    if (along < (rate > 0.0 ? slack : -slack)) return false;
    vec3 met = origin + direction * along - corner;
    return all(greaterThanEqual(met, vec3(-slack))) && all(lessThanEqual(met, vec3(edge + slack)));
}

// The place after the cell of `edge` around `place` on a ray, whose direction has the reciprocal
// `inverse` and points up where `ahead` is 1. `distance` is where the ray leaves the cell [voxels].
ivec3 next_place(ivec3 place, int edge, vec3 origin, vec3 direction, vec3 inverse, ivec3 ahead,
    out float distance) {
    ivec3 low = place & ivec3(-edge);
    vec3 leave = (vec3(low + ahead * edge) - origin) * inverse;
    distance = min(leave.x, min(leave.y, leave.z));
    bvec3 crossed = lessThanEqual(leave, vec3(distance));
    ivec3 along = clamp(ivec3(floor(origin + direction * distance)), low, low + edge - 1);
    return mix(along, mix(low - 1, low + edge, greaterThan(ahead, ivec3(0))), crossed);
}

bool is_inside(ivec3 place, uint resolution) {
    return all(greaterThanEqual(place, ivec3(0))) && all(lessThan(place, ivec3(resolution)));
}

// Number of the first voxel hit, or −1; `distance` is where the ray enters it, or leaves the space
// [voxels].
int trace(vec3 origin, vec3 direction, vec3 receiver, vec3 receiver_normal, TraceSettings s,
    out float distance) {
    direction = mix(direction, vec3(1e-20), lessThan(abs(direction), vec3(1e-20)));
    vec3 inverse = 1.0 / direction;
    ivec3 ahead = ivec3(greaterThan(direction, vec3(0.0)));
    ivec3 place = ivec3(floor(origin));
    distance = 0.0;
    // Each turn leaves a cell for good, so the number of cells on a line bounds the loop.
    for (uint turn = 0u; turn < 4u * s.resolution; ++turn) {
        if (!is_inside(place, s.resolution)) return -1;
        SpaceCell cell = cell_around(place);
        if (cell.slot >= 0) {
            vec3 corner = vec3(place & ivec3(-cell.edge));
            if (hits_surface(cell, corner, origin, direction, receiver, receiver_normal, s))
                return cell.slot;
        }
        place = next_place(place, cell.edge, origin, direction, inverse, ahead, distance);
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
    ivec3 place = ivec3(floor(origin));
    float distance = 0.0, occlusion = 0.0;
    for (uint turn = 0u; turn < 4u * s.resolution && distance < reach && occlusion < 1.0; ++turn) {
        if (!is_inside(place, s.resolution)) break;
        SpaceCell cell = cell_around(place);
        if (cell.slot >= 0) {
            vec3 corner = vec3(place & ivec3(-cell.edge));
            bool hit = hits_surface(cell, corner, origin, direction, receiver, receiver_normal, s);
            if (hit) occlusion += (1.0 - occlusion) * min(kappa / max(distance, 1e-6), 1.0);
        }
        place = next_place(place, cell.edge, origin, direction, inverse, ahead, distance);
    }
    return occlusion;
}

#endif
