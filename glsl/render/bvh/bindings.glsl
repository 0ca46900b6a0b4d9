// What a pass binds first that traces rays against the triangles of the scene (Rust:
// render::bvh::BINDINGS and CONSTANTS).
#ifndef LUMIVOX_BVH_BINDINGS
#define LUMIVOX_BVH_BINDINGS

layout(constant_id = 0) const uint BVH_STACK = 64;      // nodes on the longest way from a root
layout(constant_id = 1) const uint BVH_ROOTS = 1;       // hierarchies
layout(constant_id = 2) const uint BVH_MASKS = 0;       // 1: some materials have alpha masks

#ifdef RAY_QUERY
#extension GL_EXT_ray_query : require
// an instance of each hierarchy, whose triangles are in the order of bvh_triangles
layout(set = 1, binding = 0) uniform accelerationStructureEXT bvh_tree;
#else
// 1024 nodes a row, four texels each (docs/gi/ray_traced.md)
layout(set = 1, binding = 0) uniform utexture2D bvh_tree;
#endif
// 1024 triangles a row, in the order of the leaves, three texels each: xyz: first corner, edge to
// the second, edge to the third [m]; w of the first: the triangle's number, with the highest bit
// set where its material has a mask
layout(set = 1, binding = 1) uniform utexture2D bvh_triangles;
// of each hierarchy: its root; with RAY_QUERY its first triangle
layout(std430, set = 1, binding = 2) restrict readonly buffer BvhRoots { uint bvh_roots[]; };
// four of each material: albedo, emission, normal, mask; x: first texel; y: width and height, 16
// bits each, 0 where there is none
layout(std430, set = 1, binding = 3) restrict readonly buffer TextureRows {
    uvec2 texture_rows[];
};
// all textures one behind the other, RGBA8 a texel
layout(set = 1, binding = 4) uniform utexture2DArray texels;

#endif
