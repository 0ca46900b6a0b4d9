// Rays against the triangles of the scene: the nearest hit, or whether there is any. With RAY_QUERY
// the device traces them. The including pass binds what render/bvh/bindings.glsl declares.
#ifndef LUMIVOX_BVH_TRAVERSE
#define LUMIVOX_BVH_TRAVERSE

#ifdef RAY_QUERY
#include "render/bvh/query.glsl"
#else
#include "render/bvh/nodes.glsl"
#endif

RayHit closest_hit(vec3 origin, vec3 direction, uint leaves) {
    return traverse(origin, direction, uintBitsToFloat(0x7f800000u), leaves, NO_TRIANGLE, false);
}

// Whether something but the triangles `leaves` and `target` is nearer than `distance`.
bool is_occluded(vec3 origin, vec3 direction, float distance, uint leaves, uint target) {
    return traverse(origin, direction, distance, leaves, target, true).triangle != NO_TRIANGLE;
}

#endif
