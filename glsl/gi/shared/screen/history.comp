#version 460
#extension GL_GOOGLE_include_directive : require
// screen.history: what was gathered in this frame and in those before, each surface followed to
// where it was (reverse reprojection, Nehab et al. 2007; Hong 2015, section 4.3).
layout(local_size_x = 8, local_size_y = 8) in;

layout(set = 1, binding = 0) uniform texture2D view_depth;
layout(set = 1, binding = 1) uniform utexture2D normals;
layout(set = 1, binding = 2) uniform texture2D motion;
layout(set = 1, binding = 3) uniform texture2D gathered;
layout(set = 1, binding = 4) uniform texture2D light_before;
layout(set = 1, binding = 5) uniform utexture2D guide_before;
layout(set = 1, binding = 6, rgba32f) uniform restrict writeonly image2D light_now;
// x: view depth [m], 0 without a surface; y, z: normals, as in `normals`; w: weight [frames]
layout(set = 1, binding = 7, rgba32ui) uniform restrict writeonly uimage2D guide_now;

layout(push_constant) uniform HistoryParams {
    vec4 eye_before;         // xyz: where the frame before was seen from [m]; w: 1 if there was one
    vec4 ray_right_before;   // as in FrameConstants
    vec4 ray_up_before;
    vec4 ray_forward_before;
    float longest;           // what history and this frame weigh at most [frames]
    float plane_tolerance;   // [footprints]
    float normal_cosine;
} params;

#include "gi/shared/screen/one_surface.glsl"

// Less than this of a bilinear sample is no history; a small part of one weighs less.
const float LEAST_KEPT = 1e-3, WHOLE_KEPT = 0.05;

vec3 position_before(vec2 place, float depth_m) {
    vec2 ndc = place / vec2(frame.size_px.xy) * 2.0 - 1.0;
    return params.eye_before.xyz
        + depth_m
        * (params.ray_forward_before.xyz + ndc.x * params.ray_right_before.xyz
            - ndc.y * params.ray_up_before.xyz);
}

// What the frame before knew of a surface, and what that weighs [frames].
struct History {
    vec4 light;
    float weight;
};

History find_history(ivec2 pixel, Surface surface) {
    History found = History(vec4(0.0), 0.0);
    vec3 moved = texelFetch(sampler2D(motion, nearest_clamp), pixel, 0).xyz;
    vec2 place = vec2(pixel) + 0.5 + moved.xy;
    vec2 size = vec2(frame.size_px.xy);
    if (params.eye_before.w == 0.0 || any(lessThan(place, vec2(0.0)))
        || any(greaterThan(place, size)))
        return found;
    vec3 position = position_before(place, moved.z);
    float off_plane_m = params.plane_tolerance * footprint_of(surface.position_ws);
    vec2 corner = floor(place - 0.5), share = place - 0.5 - corner;
    float kept = 0.0;
    for (int i = 0; i < 4; ++i) {
        ivec2 step = ivec2(i & 1, i >> 1), tap = ivec2(corner) + step;
        if (any(lessThan(tap, ivec2(0))) || any(greaterThanEqual(tap, ivec2(size)))) continue;
        uvec4 guide = texelFetch(usampler2D(guide_before, nearest_clamp), tap, 0);
        float depth_m = uintBitsToFloat(guide.x);
        vec3 from_here = position_before(vec2(tap) + 0.5, depth_m) - position;
        if (depth_m <= 0.0 || abs(dot(from_here, surface.geometric_normal)) > off_plane_m
            || dot(surface.shading_normal, unpack_unit(guide.z)) < params.normal_cosine)
            continue;
        vec2 near = mix(1.0 - share, share, vec2(step));
        float part = near.x * near.y;
        found.light += part * texelFetch(sampler2D(light_before, nearest_clamp), tap, 0);
        found.weight += part * uintBitsToFloat(guide.w);
        kept += part;
    }
    if (kept < LEAST_KEPT) return History(vec4(0.0), 0.0);
    found.light /= kept;
    found.weight *= min(kept / WHOLE_KEPT, 1.0) / kept;
    return found;
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, ivec2(frame.size_px.xy)))) return;
    Surface surface;
    if (!read_surface(pixel, surface)) {
        imageStore(light_now, pixel, vec4(0.0));
        imageStore(guide_now, pixel, uvec4(0u));
        return;
    }
    vec4 light = texelFetch(sampler2D(gathered, nearest_clamp), pixel, 0);
    History history = find_history(pixel, surface);
    float weight = min(history.weight, params.longest - 1.0);
    // What is no number must not stay for as long as history does.
    if (any(isnan(light)) || any(isinf(light))) {
        light = history.light;
    } else {
        light += (history.light - light) * (weight / (weight + 1.0));
        weight += 1.0;
    }
    imageStore(light_now, pixel, light);
    uvec2 packed = texelFetch(usampler2D(normals, nearest_clamp), pixel, 0).rg;
    float depth_m = texelFetch(sampler2D(view_depth, nearest_clamp), pixel, 0).r;
    imageStore(guide_now, pixel, uvec4(floatBitsToUint(depth_m), packed, floatBitsToUint(weight)));
}
