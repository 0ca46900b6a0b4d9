// Rays through the scene as the device traces them. It only finds the triangles near a ray: whether
// and where they are met is found out as in render/bvh/nodes.glsl.
#ifndef LUMIVOX_BVH_QUERY
#define LUMIVOX_BVH_QUERY

#include "render/bvh/triangle.glsl"

// The device rounds distances otherwise, within this share of them and of coordinates.
const float QUERY_ROUNDING = 1e-5;

// As in render/bvh/nodes.glsl. The device is only told of hits that are certainly behind the
// nearest: what it then leaves out is farther still, and of triangles that are as near, or nearly,
// it leaves out none.
RayHit traverse(
    vec3 origin, vec3 direction, float t_max, uint leaves, uint target, bool any) {
    RayHit hit = RayHit(NO_TRIANGLE, t_max, vec2(0.0));
    vec3 coordinates = abs(origin);
    float largest = max(coordinates.x, max(coordinates.y, coordinates.z));
    float far = t_max + QUERY_ROUNDING * (t_max + largest);
    rayQueryEXT query;
    rayQueryInitializeEXT(
        query, bvh_tree, gl_RayFlagsNoOpaqueEXT, 0xffu, origin, 0.0, direction, far);
    while (rayQueryProceedEXT(query)) {
        int tree = rayQueryGetIntersectionInstanceIdEXT(query, false);
        uint slot = bvh_roots[tree]
            + uint(rayQueryGetIntersectionPrimitiveIndexEXT(query, false));
        if (meet(slot, origin, direction, leaves, target, hit)) {
            if (any) break;
            far = hit.t + QUERY_ROUNDING * (hit.t + largest);
        }
        if (rayQueryGetIntersectionTEXT(query, false) > far)
            rayQueryConfirmIntersectionEXT(query);
    }
    return hit;
}

#endif
