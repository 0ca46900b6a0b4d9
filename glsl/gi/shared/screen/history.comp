#version 460
#extension GL_GOOGLE_include_directive : require
// screen.history: what was gathered in this frame and in those before, each surface followed to
// where it was (reverse reprojection, Nehab et al. 2007; Hong 2015, section 4.3). MOMENTS: and how
// the luminance of the frames differs. MIRRORED: of mirrored light, which slides over surfaces
// where the eye moves: the narrower a lobe is, the fewer frames it weighs.
layout(local_size_x = 8, local_size_y = 8) in;

layout(constant_id = 0) const bool TESTS_MATERIAL = false;

layout(set = 1, binding = 0) uniform texture2D view_depth;
layout(set = 1, binding = 1) uniform utexture2D normals;
layout(set = 1, binding = 2) uniform texture2D motion;
layout(set = 1, binding = 3) uniform texture2D gathered;
layout(set = 1, binding = 4) uniform texture2D light_before;
layout(set = 1, binding = 5) uniform utexture2D guide_before;
layout(set = 1, binding = 6) uniform texture2D change;   // of light since the frame before
layout(set = 1, binding = 7) uniform utexture2D material;
layout(set = 1, binding = 8) uniform utexture2D material_before;
layout(set = 1, binding = 9, rgba32f) uniform restrict writeonly image2D light_now;
#ifdef MIRRORED
layout(set = 1, binding = 10) uniform texture2D specular;   // a: roughness
#else
#ifdef MOMENTS
layout(set = 1, binding = 11) uniform texture2D moments_before;
// x: mean of luminance over the frames; y: mean of its square
layout(set = 1, binding = 12, rgba32f) uniform restrict writeonly image2D moments_now;
#endif
// x: view depth [m], 0 without a surface; y: weight of visibility [frames]; z: shading normal, as
// in `normals`; w: weight of light [frames]
layout(set = 1, binding = 10, rgba32ui) uniform restrict writeonly uimage2D guide_now;
#endif

layout(push_constant) uniform HistoryParams {
    vec4 eye_before;         // xyz: where the frame before was seen from [m]; w: 1 if there was one
    vec4 ray_right_before;   // as in FrameConstants
    vec4 ray_up_before;
    vec4 ray_forward_before;
    uvec2 change_size;       // [texels]
    float change_px;         // width of a texel of it; 0 where light has not changed
    float change_slack;      // change that takes half of a frame's weight
    float longest;           // what visibility, with this frame, weighs at most [frames]
    float longest_light;     // what light does
    float plane_tolerance;   // [footprints]
    float normal_cosine;
} params;

#include "gi/shared/screen/one_surface.glsl"
#include "shared/turned.glsl"
#include "shared/ggx.glsl"
#include "shared/luminance.glsl"

// Less than this of a bilinear sample is no history.
const float LEAST_KEPT = 1e-3;

// Light slides along the edge of a surface by no more, in the mean of frames [px].
const float LONGEST_SLIDE_PX = 1.0;

// Cosine of the largest turn of a surface from frame to frame.
const float LEAST_TURNED = -0.8;

vec3 position_before(vec2 place, float depth_m) {
    vec2 ndc = place / vec2(frame.size_px.xy) * 2.0 - 1.0;
    return params.eye_before.xyz
        + depth_m
        * (params.ray_forward_before.xyz + ndc.x * params.ray_right_before.xyz
            - ndc.y * params.ray_up_before.xyz);
}

// What the frame before knew of a surface, and what light and visibility weigh [frames].
struct History {
    vec4 light;
    vec2 weights;
    vec2 moments;
};

// Brings light of the frame before, which was seen there, to this frame's: a factor, and in alpha
// what it weighs at most [frames].
vec4 changed_light(vec2 place) {
    float longest = params.longest_light - 1.0;
    if (params.change_px == 0.0) return vec4(vec3(1.0), longest);
    ivec2 tile = min(ivec2(place / params.change_px), ivec2(params.change_size) - 1);
    vec4 changed = texelFetch(sampler2D(change, nearest_clamp), tile, 0);
    float slack = params.change_slack;
    return vec4(changed.rgb,
        changed.a > 0.0 ? min(longest, max(slack / changed.a - slack, 0.0)) : longest);
}

#ifdef MIRRORED
// What a mirrored light weighs at most [frames], so that in the mean of them it slides by a quarter
// of the lobe's half angle. `now` and `then` are the directions to the eye seen from the surface.
float longest_mirrored(ivec2 pixel, Surface now, vec3 to_eye_now, Surface then, vec3 to_eye_then) {
    float alpha = ggx_alpha(texelFetch(sampler2D(specular, nearest_clamp), pixel, 0).a);
    float half_angle = 2.0 * atan(0.57735 * alpha);
    float turned = length(now.shading_normal - then.shading_normal);
    float slid = length(to_eye_now - to_eye_then) + 2.0 * turned;
    return slid > 0.0 ? 0.5 * half_angle / slid : params.longest;
}
#endif

// A surface's normals in the frame before: of what has moved, `turned` has the shading normal.
// False where that was nearly the opposite.
bool turn_back(float turned, inout Surface surface) {
    if (turned == 0.0) return true;
    vec3 before = unpack_turned(turned);
    surface.geometric_normal = rotated(surface.shading_normal, before, surface.geometric_normal);
    bool is_known = dot(surface.shading_normal, before) > LEAST_TURNED;
    surface.shading_normal = before;
    return is_known;
}

uint material_at(utexture2D materials, ivec2 pixel) {
    return texelFetch(usampler2D(materials, nearest_clamp), pixel, 0).r;
}

History find_history(ivec2 pixel, Surface surface) {
    History found = History(vec4(0.0), vec2(0.0), vec2(0.0));
    vec4 moved = texelFetch(sampler2D(motion, nearest_clamp), pixel, 0);
    vec2 place = vec2(pixel) + 0.5 + moved.xy;
    vec2 size = vec2(frame.size_px.xy);
    if (params.eye_before.w == 0.0 || any(lessThan(place, vec2(0.0)))
        || any(greaterThan(place, size)))
        return found;
    float off_plane_m = params.plane_tolerance * footprint_of(surface.position_ws);
    Surface seen = surface;
    if (!turn_back(moved.w, surface)) return found;
    vec3 position = position_before(place, moved.z);
    vec2 corner = floor(place - 0.5), share = place - 0.5 - corner;
    float kept = 0.0;
    vec2 aside_px = vec2(0.0);
    for (int i = 0; i < 4; ++i) {
        ivec2 step = ivec2(i & 1, i >> 1), tap = ivec2(corner) + step;
        if (any(lessThan(tap, ivec2(0))) || any(greaterThanEqual(tap, ivec2(size)))) continue;
        uvec4 guide = texelFetch(usampler2D(guide_before, nearest_clamp), tap, 0);
        float depth_m = uintBitsToFloat(guide.x);
        vec3 from_here = position_before(vec2(tap) + 0.5, depth_m) - position;
        if (depth_m <= 0.0 || abs(dot(from_here, surface.geometric_normal)) > off_plane_m
            || dot(surface.shading_normal, unpack_unit(guide.z)) < params.normal_cosine)
            continue;
        if (TESTS_MATERIAL) {
            if (material_at(material, pixel) != material_at(material_before, tap)) continue;
        }
        vec2 near = mix(1.0 - share, share, vec2(step));
        float part = near.x * near.y;
        vec4 light = texelFetch(sampler2D(light_before, nearest_clamp), tap, 0);
        found.light += part * light;
#ifdef MOMENTS
        found.moments += part * texelFetch(sampler2D(moments_before, nearest_clamp), tap, 0).xy;
#endif
#ifdef MIRRORED
        found.weights += part * light.a;
#else
        found.weights += part * uintBitsToFloat(guide.wy);
#endif
        kept += part;
        aside_px += part * (vec2(step) - share);
    }
    if (kept < LEAST_KEPT) return History(vec4(0.0), vec2(0.0), vec2(0.0));
    found.light /= kept;
    found.moments /= kept;
    // Pixels of another surface are missing, so the mean of the rest is of a place beside this one.
    float slid_px = length(aside_px) / kept;
    found.weights = min(found.weights / kept, vec2(LONGEST_SLIDE_PX / max(slid_px, 1e-4)));
    vec4 changed = changed_light(place);
    float brighter = luminance_of(changed.rgb);
#ifdef MIRRORED
    // What is mirrored may have changed by another factor, so it is forgotten.
    float apart = 1.0 - min(brighter, 1.0 / max(brighter, 1e-6));
    if (apart > 0.0)
        changed.a = min(changed.a, params.change_slack / apart - params.change_slack);
#else
    found.light.rgb *= changed.rgb;
    found.moments *= vec2(brighter, brighter * brighter);
#endif
    found.weights = min(found.weights, vec2(changed.a, params.longest - 1.0));
#ifdef MIRRORED
    vec3 to_eye_now = normalize(frame.eye_ws.xyz - seen.position_ws),
         to_eye_then = normalize(params.eye_before.xyz - position);
    float longest = longest_mirrored(pixel, seen, to_eye_now, surface, to_eye_then);
    found.weights = min(found.weights, vec2(longest));
#endif
    return found;
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, ivec2(frame.size_px.xy)))) return;
    Surface surface;
    if (!read_surface(pixel, surface)) {
        imageStore(light_now, pixel, vec4(0.0));
#ifndef MIRRORED
        imageStore(guide_now, pixel, uvec4(0u));
#endif
        return;
    }
    vec4 light = texelFetch(sampler2D(gathered, nearest_clamp), pixel, 0);
    History history = find_history(pixel, surface);
    vec2 weights = history.weights;
#ifdef MOMENTS
    float luminance = luminance_of(light.rgb);
    vec2 moments = vec2(luminance, luminance * luminance);
    bool is_number = !any(isnan(light)) && !any(isinf(light));
    if (is_number) moments += (history.moments - moments) * (weights.x / (weights.x + 1.0));
    imageStore(moments_now, pixel, vec4(is_number ? moments : history.moments, 0.0, 0.0));
#endif
    // What is no number must not stay for as long as history does.
    if (any(isnan(light)) || any(isinf(light))) {
        light = history.light;
    } else {
        light += (history.light - light) * (weights / (weights + 1.0)).xxxy;
        weights += 1.0;
    }
#ifdef MIRRORED
    imageStore(light_now, pixel, vec4(light.rgb, weights.x));
#else
    imageStore(light_now, pixel, light);
    uint shading = texelFetch(usampler2D(normals, nearest_clamp), pixel, 0).g;
    float depth_m = texelFetch(sampler2D(view_depth, nearest_clamp), pixel, 0).r;
    imageStore(guide_now, pixel,
        uvec4(floatBitsToUint(depth_m), floatBitsToUint(weights.y), shading,
            floatBitsToUint(weights.x)));
#endif
}
