// The texels of a level, as gi/shared/cone/structure.glsl draws them.

Cell cell_at(vec3 position, vec3 direction, float resolution, float level) {
    float edge = exp2(level);
    // A little further, inside the cell.
    float slack = 1e-3 * edge;
    return Cell(floor((position + slack * direction) / edge) * edge, edge, slack, false);
}

vec3 cell_color(Cell cell, vec3 position, float level) {
    return level_color(log2(cell.edge));
}
