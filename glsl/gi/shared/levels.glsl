// How cells are drawn by their level. The including pass includes shared/frame.glsl before.
#ifndef LUMIVOX_LEVELS
#define LUMIVOX_LEVELS

// A colour for each level, finer ones first: red, yellow, green, cyan, blue, magenta; then the
// same, darker.
vec3 level_color(float level) {
    return (level < 5.5 ? 1.0 : 0.5)
        * (0.5 + 0.5 * cos(2.0 * PI * (level - vec3(0.0, 2.0, 4.0)) / 6.0));
}

// 1 on a line of this half width [px], at distances from one across each axis [cells], where a
// pixel is so large along each [cells]. Lines between cells of this edge fade before they are all
// that is seen.
float line_share(vec3 distances, float half_width_px, vec3 pixel, float edge) {
    vec3 share = clamp(half_width_px + 0.5 - distances / pixel, 0.0, 1.0)
        * clamp(0.25 * edge / pixel - 0.5, 0.0, 1.0);
    return max(share.x, max(share.y, share.z));
}

#endif
