#version 460
#extension GL_GOOGLE_include_directive : require
// lpv.level_structure: of a full octree of cells, the level whose light a seen surface looks up.
//
// Merged, a cell of a level has its own light, or that of the level above it (Olovsson 2012, eq.
// 10), so the level is the first that differs from the one above. Where levels add up, it is the
// one that adds most.
layout(local_size_x = 8, local_size_y = 8) in;

layout(constant_id = 0) const bool FINEST = true;   // as published

layout(set = 1, binding = 0, rgba32f) uniform restrict readonly image3D sum_0;
layout(set = 1, binding = 1, rgba32f) uniform restrict readonly image3D sum_1;
layout(set = 1, binding = 2, rgba32f) uniform restrict readonly image3D sum_2;
layout(set = 1, binding = 3, rgba32f) uniform restrict readonly image3D sum_3;
layout(set = 1, binding = 4, rgba32f) uniform restrict readonly image3D sum_4;
layout(set = 1, binding = 5, rgba32f) uniform restrict readonly image3D sum_5;
layout(set = 1, binding = 6, rgba32f) uniform restrict readonly image3D sum_6;
layout(set = 1, binding = 7, rgba32f) uniform restrict readonly image3D sum_7;
layout(set = 1, binding = 8) uniform texture2D view_depth;
layout(set = 1, binding = 9) uniform utexture2D normals;
layout(set = 1, binding = 10, rgba32f) uniform restrict writeonly image2D seen;

#include "shared/gbuffer.glsl"
#include "gi/lpv/lobes.glsl"
#include "gi/lpv/structure/surface.glsl"

layout(push_constant) uniform LevelStructureParams {
    CellGrid grid;   // the finest
    float shift;     // off the surface [cells]
    uint from;       // the finest level that is shown
    uint count;      // of levels
} params;

vec4 sum_at(uint level, ivec3 texel) {
    switch (level) {
    case 0u: return imageLoad(sum_0, texel);
    case 1u: return imageLoad(sum_1, texel);
    case 2u: return imageLoad(sum_2, texel);
    case 3u: return imageLoad(sum_3, texel);
    case 4u: return imageLoad(sum_4, texel);
    case 5u: return imageLoad(sum_5, texel);
    case 6u: return imageLoad(sum_6, texel);
    default: return imageLoad(sum_7, texel);
    }
}

// The light of a level and all above it, in the cell there around one of the finest.
mat4 merged(uint level, ivec3 cell) {
    CellGrid grid = params.grid;
    grid.size.xyz = grid.size.xyz + (1 << level) - 1 >> level;
    mat4 found;
    for (int i = 0; i < LOBE_COEFFICIENTS; ++i)
        found[i] = sum_at(level, sum_texel(grid, cell >> level, i));
    return found;
}

// The level, or −1 where there is no light.
int level_of(ivec3 cell) {
    mat4 own = merged(0u, cell);
    int found = -1;
    float most = 0.0;
    for (uint level = 0u; level < params.count; ++level) {
        mat4 above = mat4(0.0);
        if (level + 1u < params.count) above = merged(level + 1u, cell);
        float added = 0.0;
        for (int i = 0; i < LOBE_COEFFICIENTS; ++i)
            added += dot(abs(own[i].rgb - above[i].rgb), vec3(1.0));
        if (added > most) {
            found = int(level);
            most = added;
            if (FINEST) break;
        }
        own = above;
    }
    return found;
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, ivec2(frame.size_px.xy)))) return;
    Surface surface;
    vec4 result = vec4(0.0);
    if (read_surface(pixel, surface)) {
        vec3 place = to_cells(params.grid, surface.position_ws), normal = surface.geometric_normal;
        vec3 from_eye = place - to_cells(params.grid, frame.eye_ws.xyz);
        ivec3 cell = clamp(ivec3(floor(shifted(place, normal, params.shift))), ivec3(0),
            params.grid.size.xyz - 1);
        int level = level_of(cell);
        vec3 color = level < 0 ? vec3(0.0) : GREY;
        if (level >= int(params.from))
            color = draw_surface(float(level), place, float(1 << level), normal,
                pixel_on(normal, normalize(from_eye), length(from_eye)));
        result = vec4(color, float(level + 1));
    }
    imageStore(seen, pixel, result);
}
