// What a pass binds first that traces rays against the triangles of the scene (Rust:
// render::bvh::BINDINGS and CONSTANTS).
#ifndef LUMIVOX_BVH_BINDINGS
#define LUMIVOX_BVH_BINDINGS

layout(constant_id = 0) const uint BVH_STACK = 64;      // boxes that a traversal puts off at most
layout(constant_id = 1) const uint BVH_ROOTS = 1;       // hierarchies
layout(constant_id = 2) const uint BVH_MASKS = 0;       // 1: some materials have alpha masks

layout(std430, set = 1, binding = 0) restrict readonly buffer BvhNodes { uint bvh_nodes[]; };
// number of each triangle; the highest bit is set where its material has a mask
layout(std430, set = 1, binding = 1) restrict readonly buffer BvhTriangles {
    uint bvh_triangles[];
};
// the root of what stands still and of each model that may move
layout(std430, set = 1, binding = 2) restrict readonly buffer BvhRoots { uint bvh_roots[]; };
// four of each material: albedo, emission, normal, mask; x: first texel; y: width and height, 16
// bits each, 0 where there is none
layout(std430, set = 1, binding = 3) restrict readonly buffer TextureRows {
    uvec2 texture_rows[];
};
// all textures one behind the other, RGBA8 a texel
layout(set = 1, binding = 4) uniform utexture2DArray texels;

#endif
