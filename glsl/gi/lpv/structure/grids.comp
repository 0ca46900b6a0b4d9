#version 460
#extension GL_GOOGLE_include_directive : require
// lpv.grid_structure: which of nested grids a seen surface looks its light up in. Each grid has its
// colour, mixed by shares where two count, and its cells are darker along their edges. A white line
// is the border of a grid.
layout(local_size_x = 8, local_size_y = 8) in;

layout(constant_id = 0) const uint LEVELS = 1u;   // nested grids

layout(set = 1, binding = 0) uniform texture2D view_depth;
layout(set = 1, binding = 1) uniform utexture2D normals;
layout(set = 1, binding = 2, rgba32f) uniform restrict writeonly image2D seen;

#include "shared/gbuffer.glsl"
#include "gi/lpv/structure/surface.glsl"

layout(push_constant) uniform GridStructureParams {
    CellGrid grid;   // the outermost
    uvec4 inner;     // where each inner grid is from the first cell of the one around it [its own
                     // cells], 10 bits an axis
    float shift;     // off the surface [cells]
    float blend;     // cells over which a grid goes over into the one around it
    uint from;       // the finest level that is shown
} params;

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, ivec2(frame.size_px.xy)))) return;
    Surface surface;
    vec4 result = vec4(0.0);
    if (read_surface(pixel, surface)) {
        vec3 normal = surface.geometric_normal;
        vec3 from_eye = surface.position_ws - frame.eye_ws.xyz;
        float distance_cells = length(from_eye) / params.grid.place.w;
        vec3 places[LEVELS], lattice = to_lattice(params.grid, surface.position_ws);
        ivec3 first = params.grid.first.xyz;
        for (uint level = 0u; level < LEVELS; ++level) {
            if (level > 0u) {
                uint inner = params.inner[level - 1u];
                first = 2 * first + ivec3(inner & 1023u, inner >> 10 & 1023u, inner >> 20);
                lattice *= 2.0;
            }
            places[level] = lattice - vec3(first);
        }
        vec3 middle = 0.5 * vec3(params.grid.size.xyz);
        float left = 1.0, border = 0.0;
        for (uint level = LEVELS; level-- > 0u && left > 0.0;) {
            vec3 looked_up = shifted(places[level], normal, params.shift);
            vec3 inside = middle - 0.5 - abs(looked_up - middle);
            float reach = min(inside.x, min(inside.y, inside.z)), share = float(reach >= 0.0);
            if (params.blend > 0.0) share = clamp(reach / params.blend, 0.0, 1.0);
            if (level == 0u) share = 1.0;
            vec3 size_px = pixel_on(
                normal, normalize(from_eye), distance_cells * float(1u << level));
            float finer = float(LEVELS - 1u - level);
            vec3 color = GREY;
            if (finer >= float(params.from))
                color = draw_surface(finer, places[level], 1.0, normal, size_px);
            result += left * share * vec4(color, finer + 1.0);
            left *= 1.0 - share;
            // Where the other two axes are inside.
            vec3 others = vec3(
                min(inside.y, inside.z), min(inside.x, inside.z), min(inside.x, inside.y));
            vec3 to_border = mix(vec3(FAR), along_plane(abs(inside), normal),
                greaterThan(others, vec3(0.0)));
            if (level > 0u) border = max(border, line_share(to_border, 1.0, size_px, FAR));
        }
        result.rgb = mix(result.rgb, vec3(1.0), border);
    }
    imageStore(seen, pixel, result);
}
