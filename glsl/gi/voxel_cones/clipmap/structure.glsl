// The texels of a level, or of the finest level that the clipmap has there, as
// gi/shared/cone/structure.glsl draws them.

Cell cell_at(vec3 position, vec3 direction, float resolution, float level) {
    // Where a level begins to fade, that is no power of two.
    float edge = max(exp2(level), exp2(ceil(log2(largest_texel(position)) - 1e-3)));
    // A little further, inside the cell.
    float slack = 1e-3 * edge;
    return Cell(floor((position + slack * direction) / edge) * edge, edge, slack, false);
}

// The colour of the level that a cell is read from. In the border where a level fades, it is mixed
// with the next level's colour, half white.
vec3 cell_color(Cell cell, vec3 position, float level) {
    float faded = level < float(LEVELS)
        ? max(faded_level(position, min(int(level), LEVELS - 1)), level)
        : level;
    float share = fract(faded);
    vec3 color = mix(level_color(floor(faded)), level_color(floor(faded) + 1.0), share);
    return share > 0.0 ? mix(color, vec3(1.0), 0.5) : color;
}
