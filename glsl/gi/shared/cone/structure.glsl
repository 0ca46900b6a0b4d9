// How a volume divides space: the cells that a ray meets on one of its levels, and how they are
// drawn.
#ifndef LUMIVOX_STRUCTURE
#define LUMIVOX_STRUCTURE

#include "gi/shared/levels.glsl"

// Least opacity of a texel that is not empty: rounding lets this much in from the texels beside it.
const float LEAST_OPACITY = 2e-4;

struct Cell {
    vec3 low;       // its smallest corner [voxels]
    float edge;     // [voxels]
    // a distance that is small beside it, or beside the smallest cell that may be next to it
    // [voxels]
    float slack;
    bool is_empty;  // a node without children on a coarser level than the one that is looked at
};

// The cell of a level that a position lies in; a store's structure.glsl defines it.
Cell cell_at(vec3 position, vec3 direction, float resolution, float level);

// The colour of a cell, at a position in it; a store's structure.glsl defines it.
vec3 cell_color(Cell cell, vec3 position, float level);

// A cell where a ray enters it, at the largest of the distances `near`: faces in the level's
// colour, darker along the edges, and black where 2³ cells (the nodes of a tile, the texels of a
// mip's texel) end. An empty node shows only its edges, faintly where it is small. The camera's own
// cell hides nothing.
vec4 draw_cell(Cell cell, bool is_full, vec3 origin, vec3 direction, vec3 near, float level) {
    float t = max(near.x, max(near.y, near.z));
    vec3 point = origin + t * direction;
    vec3 across = point - cell.low;
    // Through one face, where a ray meets an edge.
    bvec3 is_entered = equal(near, vec3(t));
    is_entered.yz =
        bvec2(is_entered.y && !is_entered.x, is_entered.z && !is_entered.x && !is_entered.y);
    bvec3 is_second = greaterThan(fract(0.5 * floor(cell.low / cell.edge + 0.5)), vec3(0.25));
    // On a face that is seen at a grazing angle a pixel is long along the ray.
    vec3 slope = direction / dot(vec3(is_entered), direction);
    vec3 pixel = max(t, 1e-6) * 2.0 * length(frame.ray_up.xyz) / float(frame.size_px.y)
        * sqrt(1.0 + slope * slope);
    vec3 to_cell = mix(min(across, cell.edge - across), vec3(1e9), is_entered);
    vec3 to_tile = mix(mix(across, cell.edge - across, is_second), vec3(1e9), is_entered);
    float cell_line = line_share(to_cell, 0.5, pixel, cell.edge);
    float tile_line = line_share(to_tile, 1.0, pixel, 2.0 * cell.edge);
    vec3 color = cell_color(cell, point + 1e-3 * cell.edge * direction, level);
    // Faces across x, y and z are told apart.
    vec3 face = dot(vec3(is_entered), vec3(0.8, 1.0, 0.6)) * (1.0 - 0.5 * cell_line)
        * (1.0 - 0.9 * tile_line) * color;
    vec4 drawn = is_full ? vec4(min(face, vec3(1.0)), 1.0) : vec4(0.0);
    if (cell.is_empty)
        drawn = min(0.1 * (log2(cell.edge) - level), 0.4) * cell_line * vec4(color, 1.0);
    return t > 0.0 ? drawn : vec4(0.0);
}

#endif
