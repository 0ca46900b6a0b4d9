#version 460
#extension GL_GOOGLE_include_directive : require
// lpv.geometry: the surfaces that a light sees, as what blocks light (Kaplanyan & Dachsbacher 2010,
// section 5.2). A texel is a surfel of area A = Ω r² / |cos|; of a parallel light, the beam's area
// over |cos|.
layout(local_size_x = 8, local_size_y = 8) in;

#include "shared/light_view.glsl"
#include "gi/lpv/grid.glsl"

layout(std430, set = 1, binding = 0) restrict readonly buffer LightViews {
    LightView light_views[];
};
layout(set = 1, binding = 1) uniform texture2DArray shadow_maps;
layout(set = 1, binding = 2) uniform utexture2DArray rsm_normal;
// x, y, z of A n, then A, node by node
layout(std430, set = 1, binding = 3) restrict buffer AreaSums { int areas[]; };

layout(push_constant) uniform GeometryParams {
    CellGrid grid;
    uint light;
    uint stride;       // texels along an edge of the square that one texel stands for
    float area_unit;   // one integer step [m²]
} params;

#include "gi/lpv/areas.glsl"
#include "gi/lpv/reflected.glsl"

void main() {
    uvec4 views = lights[params.light].views;
    if (gl_GlobalInvocationID.z >= views.y) return;
    int layer = int(views.x + gl_GlobalInvocationID.z);
    LightView view = light_views[layer];
    ivec2 first = ivec2(gl_GlobalInvocationID.xy) * BLOCK;
    if (any(greaterThanEqual(first * int(params.stride), ivec2(view.light.y)))) return;
    Areas found = Areas(-1, vec4(0.0));
    for (int i = 0; i < BLOCK * BLOCK; ++i) {
        Reflected texel = read_reflected(first + in_block(i), layer, view, int(params.stride));
        collect(found, Surfel(texel.is_there, texel.position, texel.normal, texel.area));
    }
    add(found);
}
