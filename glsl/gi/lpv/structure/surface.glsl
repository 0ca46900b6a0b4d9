// A seen surface by the level of the cell that its light is looked up in. The including pass
// includes shared/gbuffer.glsl before.
#ifndef LUMIVOX_LPV_STRUCTURE
#define LUMIVOX_LPV_STRUCTURE

#include "gi/lpv/grid.glsl"
#include "gi/shared/levels.glsl"

// Of levels that are not shown.
const vec3 GREY = vec3(0.25);
// Nothing is that far [cells].
const float FAR = 1e9;

// How large a pixel is along each axis [cells], on a plane so far off [cells].
vec3 pixel_on(vec3 normal, vec3 direction, float t) {
    vec3 slope = direction / max(abs(dot(normal, direction)), 1e-3);
    return max(t, 1e-6) * 2.0 * length(frame.ray_up.xyz) / float(frame.size_px.y)
        * sqrt(1.0 + slope * slope);
}

// Distances across each axis, along a plane instead; none to planes that it nearly lies in.
vec3 along_plane(vec3 distances, vec3 normal) {
    vec3 sines = sqrt(max(1.0 - normal * normal, vec3(0.0)));
    return mix(vec3(FAR), distances / max(sines, vec3(1e-3)), greaterThan(sines, vec3(0.4)));
}

// The colour of a level at a place of a surface [cells], darker along the edges of its cells.
vec3 draw_surface(float level, vec3 place, float edge, vec3 normal, vec3 pixel) {
    vec3 across = fract(place / edge) * edge;
    vec3 distances = along_plane(min(across, edge - across), normal);
    float line = line_share(distances, 0.5, pixel, edge);
    return level_color(level) * (1.0 - 0.6 * line) * (0.6 + 0.4 * abs(normal.y));
}

#endif
