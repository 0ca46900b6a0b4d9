// Exact rays through the voxels of a space (three-dimensional digital differential analyser,
// Amanatides & Woo 1987, over cells of any size).
#ifndef LUMIVOX_TRACE
#define LUMIVOX_TRACE

#include "gi/shared/voxel/trace/chance.glsl"
#include "gi/shared/voxel/trace/space.glsl"

struct TraceSettings {
    uint resolution;       // edge of the space
    // a voxel whose surface lies lower than this over the receiver's tangent plane is the receiver
    // itself [edges of the voxel]
    float self_height;
    // a hit must meet the voxel's own plane ahead, within the voxel enlarged by this [edges of the
    // voxel]; negative: any touched voxel is hit
    float contour_slack;
    uint seed;   // number of the receiver, from which chance is drawn
    uint ray;    // number of the ray among those of the receiver
};

// Share of the rays along a direction that a voxel of several planes stops: the area that it shows
// them over that of its outline.
float stopped_share(Voxel voxel, vec3 direction) {
    vec3 outline = abs(direction);
    return dot(unpack_unorm10(voxel.across), outline) / (outline.x + outline.y + outline.z);
}

// Area within a voxel of the plane through a point of it [voxel faces]: the slope of the volume
// behind the plane, which inclusion and exclusion of the cube's corners give.
float area_of_plane(vec3 normal, vec3 point) {
    vec3 n = max(abs(normal), vec3(0.01));
    float d = dot(n, mix(point, 1.0 - point, lessThan(normal, vec3(0.0))));
    vec3 one = max(vec3(d) - n, vec3(0.0)), two = max(vec3(d) - n.yzx - n.zxy, vec3(0.0));
    float three = max(d - n.x - n.y - n.z, 0.0);
    return (d * d - dot(one, one) + dot(two, two) - three * three) * length(n)
        / (2.0 * n.x * n.y * n.z);
}

// A plane that is there nearly whole is whole, and so is one that only cuts off a corner: rounding
// makes no holes in walls.
const float NEARLY_WHOLE = 0.9, CORNER = 0.05;

// Share of a voxel's plane that is surface.
float filled_share(Voxel voxel, vec3 normal) {
    float whole = area_of_plane(normal, unpack_unorm10(voxel.mean_position));
    float share = length(unpack_unorm10(voxel.across)) / max(whole, CORNER);
    return whole < CORNER || share > NEARLY_WHOLE ? 1.0 : share;
}

// Whether a ray that passes through a voxel, whose smallest corner is `low`, hits the surface
// inside it.
bool hits_surface(SpaceCell cell, ivec3 low, vec3 origin, vec3 direction, vec3 receiver,
    vec3 receiver_normal, TraceSettings s) {
    Voxel voxel = surface_of(uint(cell.slot));
    float edge = float(cell.edge), slack = edge * s.contour_slack;
    vec3 corner = vec3(low);
    vec3 surface = corner + edge * unpack_unorm10(voxel.mean_position);
    if (dot(surface - receiver, receiver_normal) < edge * s.self_height) return false;
    if (slack < 0.0) return true;
    vec3 normal = unpack_mean_normal(voxel.normal);
    if (!is_one_plane(normal)) {
        // A ray leaves a corner from within the layers of its planes.
        vec3 off = mix(
            vec3(0.0), abs(origin - corner - 0.5 * edge), greaterThan(abs(normal), vec3(0.1)));
        bool outside = any(greaterThan(off, vec3(0.5 * edge + slack)));
        if (!outside && !is_opposed(voxel) && sees_back(voxel, direction)) return false;
        // A ray comes to the walls of a room from inside, so that they stop it.
        return is_concave(voxel)
            || stopped_share(voxel, direction) > chance(uvec3(low), s.seed, s.ray);
    }
    float rate = dot(normal, direction);
    if (abs(rate) < 1e-3) return true;
    float along = dot(normal, surface - origin) / rate;
    // A ray that starts on the plane is in front of it.
    if (along < (rate > 0.0 ? slack : -slack)) return false;
    vec3 met = origin + direction * along - corner;
    if (any(lessThan(met, vec3(-slack))) || any(greaterThan(met, vec3(edge + slack)))) return false;
    return filled_share(voxel, normal) > chance(uvec3(low), s.seed, s.ray);
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
    int hit = -1;
    bool goes_on = true;
    // Each turn leaves a cell for good, so the number of cells on a line bounds both loops.
    for (uint turn = 0u; goes_on;) {
        SpaceCell cell = SpaceCell(1, -1);
        // Empty cells have a loop of their own, so that lanes wait for each other and then look at
        // surfaces together.
        for (;; ++turn) {
            goes_on = turn < 4u * s.resolution && is_inside(place, s.resolution);
            if (!goes_on) break;
            cell = cell_around(place);
            if (cell.slot >= 0) break;
            place = next_place(place, cell.edge, origin, direction, inverse, ahead, distance);
        }
        if (goes_on) {
            ivec3 low = place & ivec3(-cell.edge);
            if (hits_surface(cell, low, origin, direction, receiver, receiver_normal, s)) {
                hit = cell.slot;
                goes_on = false;
            } else {
                place = next_place(place, cell.edge, origin, direction, inverse, ahead, distance);
                ++turn;
            }
        }
    }
    return hit;
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
            ivec3 low = place & ivec3(-cell.edge);
            bool hit = hits_surface(cell, low, origin, direction, receiver, receiver_normal, s);
            if (hit) occlusion += (1.0 - occlusion) * min(kappa / max(distance, 1e-6), 1.0);
        }
        place = next_place(place, cell.edge, origin, direction, inverse, ahead, distance);
    }
    return occlusion;
}

#endif
