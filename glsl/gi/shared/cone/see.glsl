// cone.see: what is seen along given lines of sight in the finest texels.
layout(local_size_x = 64) in;

#define VOLUME_BINDING 2

#include "shared/sight.glsl"

layout(std430, set = 1, binding = 0) restrict readonly buffer SightRays { SightRay sight_rays[]; };
layout(std430, set = 1, binding = 1) restrict writeonly buffer Sights { Sight sights[]; };

layout(push_constant) uniform SeeParams {
    vec4 grid;             // xyz: smallest corner of the grid [m]; w: voxel size [m]
    float resolution;      // voxels along an edge of the grid
    uint ray_count;
    uint face_stride;      // of the volume: from a face of what it stores to the next
} params;

#include "gi/shared/cone/march_settings.glsl"
#include "gi/shared/cone/march.glsl"

// Steps, in the finest texels there.
const float STEP = 0.25;
// Texels are mixed: what they hold begins half a texel too early on all sides, and somewhere in the
// texel. A line of sight hits where it meets this opacity.
const float HIT = 0.75;
// It may cross a thin surface and meet less than that. Then the most that it met covers it, from
// nothing at this opacity on.
const float GRAZED = 0.4;
// A line is past a surface where it meets this share of the most that it met.
const float PAST = 0.5;
// Less than this is as good as nothing.
const float LEAST_THROUGH = 0.01;

// rgb: light of what is met up to `end` [voxels], a: share that meets nothing.
vec4 see(vec3 origin, vec3 direction, float begin, float end) {
    vec4 seen = vec4(0.0, 0.0, 0.0, 1.0), met = vec4(0.0);
    float t = begin, most = 0.0;
    bool is_on = t < end;
    while (is_on) {
        vec3 position = origin + t * direction;
        float width = least_diameter(position);
        vec4 texel = vec4(0.0);
        if (may_see_matter(position, params.resolution, width))
            texel = sample_volume(position, params.resolution, log2(width), direction);
        met += texel;
        most = max(most, texel.a);
        t += STEP * width;
        is_on = t < end;
        if (most > HIT || texel.a < PAST * most || !is_on) {
            float opacity = clamp((most - GRAZED) / (HIT - GRAZED), 0.0, 1.0);
            seen += vec4(seen.a * opacity / max(met.a, GRAZED) * met.rgb, -seen.a * opacity);
            is_on = is_on && seen.a > LEAST_THROUGH;
            met = vec4(0.0);
            most = 0.0;
        }
    }
    return seen;
}

void main() {
    uint group = gl_WorkGroupID.x + gl_WorkGroupID.y * 65535u;
    uint index = group * 64u + gl_LocalInvocationID.x;
    if (index >= params.ray_count) return;
    SightRay ray = sight_rays[index];
    vec3 direction = ray.direction.xyz;
    if (direction == vec3(0.0)) return;
    vec3 origin = (ray.origin.xyz - params.grid.xyz) / params.grid.w;
    // It may start outside of the grid, and miss it.
    float begin = max(entry_distance(origin, direction, params.resolution), 0.0);
    float end = min(exit_distance(origin, direction, params.resolution),
        ray.origin.w / params.grid.w);
    sights[index].light = see(origin, direction, begin, end);
}
