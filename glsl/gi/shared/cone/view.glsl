// cone.view: the texels of one level of a volume as the camera sees them. A pixel's ray meets cells
// of the size of a texel, each of which has the value at its centre throughout, and covers what is
// behind it by its opacity. Or, in place of values, how the volume divides space
// (gi/shared/cone/structure.glsl).
layout(local_size_x = 8, local_size_y = 8) in;

#define VOLUME_BINDING 1

// rgb: premultiplied by opacity; a: opacity
layout(set = 1, binding = 0, rgba32f) uniform restrict image2D seen_texels;

// 2: in place of values, the structure.
layout(constant_id = 1) const uint SHOWN = 0;

layout(push_constant) uniform ViewVoxelsParams {
    vec4 grid;             // xyz: smallest corner of the grid [m]; w: voxel size [m]
    float resolution;
    float level;
    float begin_distance;  // of this dispatch, from where a ray enters the grid [voxels]
    float end_distance;    // likewise
    uint face_stride;      // of the volume: from a face of what it stores to the next
} params;

#include "gi/shared/cone/march_settings.glsl"
#include "gi/shared/cone/march.glsl"
#include "gi/shared/cone/structure.glsl"

float largest(vec3 v) {
    return max(v.x, max(v.y, v.z));
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, ivec2(frame.size_px.xy)))) return;
    vec3 origin = (frame.eye_ws.xyz - params.grid.xyz) / params.grid.w;
    vec3 direction = normalize(position_from_depth(pixel, 1.0) - frame.eye_ws.xyz);
    direction = mix(direction, vec3(1e-20), equal(direction, vec3(0.0)));
    bvec3 is_forward = greaterThan(direction, vec3(0.0));
    float entry = max(entry_distance(origin, direction, params.resolution), 0.0);
    float end =
        min(exit_distance(origin, direction, params.resolution), entry + params.end_distance);
    vec4 seen = vec4(0.0);
    if (params.begin_distance > 0.0) seen = imageLoad(seen_texels, pixel);
    float begin = entry + params.begin_distance, t = begin;
    while (t < end && seen.a < 0.995) {
        Cell cell = cell_at(origin + t * direction, direction, params.resolution, params.level);
        vec3 high = cell.low + cell.edge;
        vec3 near = (mix(high, cell.low, is_forward) - origin) / direction,
             far = (mix(cell.low, high, is_forward) - origin) / direction;
        // One that began before was seen by the dispatch before.
        if (params.begin_distance <= 0.0 || largest(near) >= begin) {
            vec4 texel = vec4(0.0);
            if (!cell.is_empty)
                texel = sample_volume(cell.low + 0.5 * cell.edge, params.resolution,
                    max(params.level, log2(cell.edge)), direction);
            if (SHOWN == 2u)
                texel =
                    draw_cell(cell, texel.a > LEAST_OPACITY, origin, direction, near, params.level);
            seen += (1.0 - seen.a) * texel;
        }
        t = max(min(far.x, min(far.y, far.z)), t + cell.slack);
    }
    imageStore(seen_texels, pixel, seen);
}
