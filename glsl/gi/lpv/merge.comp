#version 460
#extension GL_GOOGLE_include_directive : require
// lpv.merge: what a light sees of the surfaces, into the volume of all lights. A node keeps the
// light that sees most of it: surfaces that two lights see count once.
//
// Kaplanyan & Dachsbacher 2010 take the largest of each coefficient; those of band 1 have signs,
// and there the largest of −½ and 0 would be no blocker.
layout(local_size_x = 8, local_size_y = 8) in;

#include "gi/lpv/grid.glsl"
#include "gi/lpv/potential.glsl"

layout(std430, set = 1, binding = 0) restrict readonly buffer AreaSums { ivec4 areas[]; };
layout(set = 1, binding = 1, rgba16f) uniform restrict image3D blockers;

layout(push_constant) uniform MergeParams {
    CellGrid grid;
    uint is_first;      // nothing is there yet
    float share_unit;   // one integer step, over h²
} params;

void main() {
    CellGrid nodes = params.grid;
    nodes.size.xyz += 1;
    ivec3 node = ivec3(gl_GlobalInvocationID);
    if (!is_inside(nodes, node)) return;
    vec4 own = potential(vec4(areas[cell_index(nodes, node)]) * params.share_unit);
    if (params.is_first != 0u || own.x > imageLoad(blockers, node).x)
        imageStore(blockers, node, own);
}
