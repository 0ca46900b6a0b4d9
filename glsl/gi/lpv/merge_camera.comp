#version 460
#extension GL_GOOGLE_include_directive : require
// lpv.merge_camera: what the camera sees of the surfaces, with the volume of all lights, which
// stays as it is. As in lpv.merge, a node keeps what sees most of it.
layout(local_size_x = 8, local_size_y = 8) in;

#include "gi/lpv/grid.glsl"
#include "gi/lpv/potential.glsl"

layout(std430, set = 1, binding = 0) restrict readonly buffer AreaSums { ivec4 areas[]; };
layout(set = 1, binding = 1, rgba16f) uniform restrict readonly image3D of_lights;
layout(set = 1, binding = 2, rgba16f) uniform restrict writeonly image3D blockers;

layout(push_constant) uniform MergeCameraParams {
    CellGrid grid;
    float share_unit;   // one integer step, over h²
} params;

void main() {
    CellGrid nodes = params.grid;
    nodes.size.xyz += 1;
    ivec3 node = ivec3(gl_GlobalInvocationID);
    if (!is_inside(nodes, node)) return;
    vec4 own = potential(vec4(areas[cell_index(nodes, node)]) * params.share_unit);
    vec4 of_all = imageLoad(of_lights, node);
    imageStore(blockers, node, own.x > of_all.x ? own : of_all);
}
