#version 460
#extension GL_GOOGLE_include_directive : require
// lpv.geometry: the surfaces that a light sees, as what blocks light (Kaplanyan & Dachsbacher 2010,
// section 5.2). Texels add their area A = Ω r² / |cos| (of a parallel light: the beam's area over
// |cos|), and A n, to the nearest corner of a cell. Sums are integers, the same in every run.
layout(local_size_x = 8, local_size_y = 8) in;

#include "shared/light_view.glsl"
#include "gi/lpv/grid.glsl"

layout(std430, set = 1, binding = 0) restrict readonly buffer LightViews {
    LightView light_views[];
};
layout(set = 1, binding = 1) uniform texture2DArray shadow_maps;
layout(set = 1, binding = 2) uniform utexture2DArray rsm_normal;
// x, y, z of A n, then A, of all nodes
layout(std430, set = 1, binding = 3) restrict buffer Areas { ivec4 areas[]; };

layout(push_constant) uniform GeometryParams {
    CellGrid grid;
    uint light;
    uint stride;       // texels along an edge of the square that one texel stands for
    float area_unit;   // one integer step [m²]
} params;

#include "gi/lpv/reflected.glsl"

// A texel counts as so many faces of a cell at most: at a grazing angle its area has no bound.
const float MOST_FACES = 16.0;

void add(int node, vec4 sum) {
    ivec4 steps = ivec4(round(sum / params.area_unit));
    for (int i = 0; i < 4; ++i)
        if (steps[i] != 0) atomicAdd(areas[node][i], steps[i]);
}

void main() {
    uvec4 views = lights[params.light].views;
    if (gl_GlobalInvocationID.z >= views.y) return;
    int layer = int(views.x + gl_GlobalInvocationID.z);
    LightView view = light_views[layer];
    ivec2 first = ivec2(gl_GlobalInvocationID.xy) * BLOCK;
    if (any(greaterThanEqual(first * int(params.stride), ivec2(view.light.y)))) return;
    CellGrid nodes = params.grid;
    nodes.size.xyz += 1;
    float most = MOST_FACES * params.grid.place.w * params.grid.place.w;
    int node = -1;
    vec4 sum = vec4(0.0);
    for (int i = 0; i <= BLOCK * BLOCK; ++i) {
        // as in lpv.inject
        int row = i / BLOCK, column = (row & 1) == 0 ? i % BLOCK : BLOCK - 1 - i % BLOCK, own = -1;
        vec4 surface = vec4(0.0);
        if (i < BLOCK * BLOCK) {
            Reflected found =
                read_reflected(first + ivec2(column, row), layer, view, int(params.stride));
            if (found.is_there) {
                ivec3 place = ivec3(floor(to_cells(params.grid, found.position) + 0.5));
                if (is_inside(nodes, place)) own = cell_index(nodes, place);
                surface = min(found.area, most) * vec4(found.normal, 1.0);
            }
        }
        if (own != node) {
            if (node >= 0) add(node, sum);
            node = own;
            sum = vec4(0.0);
        }
        sum += surface;
    }
}
