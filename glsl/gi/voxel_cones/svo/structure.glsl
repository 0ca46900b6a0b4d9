// The nodes of the octree, as gi/shared/cone/structure.glsl draws them.

// The node of a level that a position lies in, or the node above it at which the descent ends. A
// node is drawn where the voxels of its texel are.
Cell cell_at(vec3 position, vec3 direction, float resolution, float level) {
    float finest = exp2(level);
    // A little further, inside the cell.
    float slack = 1e-3 * finest;
    vec3 inside = position + slack * direction;
    int count = int(resolution) >> int(level), above = findMSB(uint(count)) - 1;
    uvec3 at = uvec3(clamp(ivec3(floor(inside / finest)), ivec3(0), ivec3(count - 1)));
    uint tile = nodes[0], node = child_index(at >> above);
    while (above > 0 && has_child(tile, node)) {
        tile = nodes[child_of(tile, node)];
        --above;
        node = child_index(at >> above);
    }
    float edge = finest * exp2(float(above));
    return Cell(floor(inside / edge) * edge, edge, slack, above > 0);
}

vec3 cell_color(Cell cell, vec3 position, float level) {
    return level_color(log2(cell.edge));
}
