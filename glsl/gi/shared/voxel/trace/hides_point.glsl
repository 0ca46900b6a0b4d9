// Whether the voxels of a space hide a point.
#ifndef LUMIVOX_HIDES_POINT
#define LUMIVOX_HIDES_POINT

#include "gi/shared/voxel/trace/trace.glsl"

// Whether voxels hide a point of a surface from a receiver. Neither surface hides itself: what lies
// lower than `self_height` over either tangent plane is that surface.
bool hides_point(vec3 origin, vec3 point, vec3 point_normal, vec3 receiver, vec3 receiver_normal,
    TraceSettings s) {
    vec3 way = point - origin;
    float reach = length(way);
    vec3 direction = way / max(reach, 1e-6);
    direction = mix(direction, vec3(1e-20), lessThan(abs(direction), vec3(1e-20)));
    vec3 inverse = 1.0 / direction;
    ivec3 ahead = ivec3(greaterThan(direction, vec3(0.0)));
    ivec3 place = ivec3(floor(origin));
    float distance = 0.0;
    for (uint turn = 0u; turn < 4u * s.resolution && distance < reach; ++turn) {
        if (!is_inside(place, s.resolution)) return false;
        SpaceCell cell = cell_around(place);
        if (cell.slot >= 0) {
            ivec3 low = place & ivec3(-cell.edge);
            float edge = float(cell.edge);
            vec3 surface =
                vec3(low) + edge * unpack_unorm10(surface_of(uint(cell.slot)).mean_position);
            if (dot(surface - point, point_normal) >= edge * s.self_height
                && hits_surface(cell, low, origin, direction, receiver, receiver_normal, s))
                return true;
        }
        place = next_place(place, cell.edge, origin, direction, inverse, ahead, distance);
    }
    return false;
}

#endif
