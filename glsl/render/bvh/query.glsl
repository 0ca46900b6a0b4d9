// Rays through the scene as the device traces them. It only finds the triangles near a ray: whether
// and where they are met is found out as in render/bvh/nodes.glsl.
#ifndef LUMIVOX_BVH_QUERY
#define LUMIVOX_BVH_QUERY

#include "render/bvh/triangle.glsl"

// The device rounds distances otherwise: it looks a little further, as a share of the distance.
const float QUERY_ROUNDING = 1e-5;

// As in render/bvh/nodes.glsl. A hit that is confirmed hides from the device what is not nearer,
// as it rounds.
RayHit traverse(
    vec3 origin, vec3 direction, float t_max, uint leaves, uint target, bool any) {
    RayHit hit = RayHit(NO_TRIANGLE, t_max, vec2(0.0));
    float far = t_max * (1.0 + QUERY_ROUNDING);
    rayQueryEXT query;
    rayQueryInitializeEXT(
        query, bvh_tree, gl_RayFlagsNoOpaqueEXT, 0xffu, origin, 0.0, direction, far);
    while (rayQueryProceedEXT(query)) {
        int tree = rayQueryGetIntersectionInstanceIdEXT(query, false);
        uint slot = bvh_roots[tree]
            + uint(rayQueryGetIntersectionPrimitiveIndexEXT(query, false));
        if (meet(slot, origin, direction, leaves, target, hit)) {
            if (any) break;
            rayQueryConfirmIntersectionEXT(query);
        }
    }
    return hit;
}

#endif
