#version 460
#extension GL_GOOGLE_include_directive : require
// gtao.gather: ambient visibility by the horizons that the depths of the picture show (Jiménez et
// al. 2016, *Practical Real-Time Strategies for Accurate Indirect Occlusion*), and the light of the
// environment that it lets through, E = π V L(n), where that is wanted.
layout(local_size_x = 8, local_size_y = 8) in;

layout(set = 1, binding = 0) uniform texture2D view_depth;
layout(set = 1, binding = 1) uniform utexture2D normals;
layout(set = 1, binding = 2) uniform texture2D picture_depth;   // of all pixels [m]; 0: no surface
layout(set = 1, binding = 3, rgba32f) uniform restrict writeonly image2D indirect_diffuse;

layout(push_constant) uniform GtaoParams {
    uint slices;
    uint steps;             // along each half of a slice
    uint pattern;           // of a tile of pixels, each of which has slices of its own
    float distance;         // of the farthest occluders [m]; 0: any
    float falloff;          // λ of an occluder's weight 1 / (1 + λ r) [1/m]
    float thin;             // share of a horizon that what is behind it takes back
    uint has_sky;           // 0: without the light of the environment
} params;

#include "shared/receiver.glsl"
#include "shared/environment.glsl"
#include "shared/directions.glsl"
#include "shared/random.glsl"

const float HALF_PI = 0.5 * PI;

// The direction on the picture [px] in which a point at `offset` from the eye moves along
// `tangent`; a unit vector.
vec2 picture_direction(vec3 offset, vec3 tangent) {
    float depth = dot(offset, frame.ray_forward.xyz), away = dot(tangent, frame.ray_forward.xyz);
    vec2 at = vec2(dot(offset, frame.ray_right.xyz), dot(offset, frame.ray_up.xyz)),
         moved = vec2(dot(tangent, frame.ray_right.xyz), dot(tangent, frame.ray_up.xyz));
    vec2 squared = vec2(dot(frame.ray_right.xyz, frame.ray_right.xyz),
        dot(frame.ray_up.xyz, frame.ray_up.xyz));
    vec2 ndc = (moved * depth - at * away) / squared;
    vec2 pixels = ndc * vec2(frame.size_px.xy) * vec2(1.0, -1.0);
    return pixels / max(length(pixels), 1e-20);
}

// Pixels from the middle of a pixel along a unit direction to the picture's edge.
float to_edge(vec2 middle, vec2 direction) {
    vec2 safe = mix(direction, vec2(1e-20), equal(direction, vec2(0.0)));
    vec2 edge = mix(vec2(0.0), vec2(frame.size_px.xy), greaterThan(safe, vec2(0.0)));
    vec2 far = (edge - middle) / safe;
    return min(far.x, far.y);
}

// A slice: what brings an offset from the surface into it, parallel to the surface. A sample is the
// middle of a pixel, beside the slice: so all of a plane stays on its horizon.
struct Slice {
    vec3 across;
    vec3 to_eye;
};

// Cosine between the way to the eye and the highest of what is seen in a direction of the picture,
// at least `low`.
float horizon(vec3 position, Slice slice, vec2 middle, vec2 direction, float reach, float low,
    float jitter) {
    reach = min(reach, to_edge(middle, direction));
    float highest = low;
    for (uint i = 0u; i < params.steps; ++i) {
        float share = (float(i) + jitter) / float(params.steps);
        // Nearer ones are more often met.
        float along = 1.0 + max(reach - 1.0, 0.0) * share * share;
        ivec2 pixel = ivec2(floor(middle + direction * along));
        if (any(lessThan(pixel, ivec2(0)))
            || any(greaterThanEqual(pixel, ivec2(frame.size_px.xy))))
            break;
        float depth_m = texelFetch(sampler2D(picture_depth, nearest_clamp), pixel, 0).r;
        vec3 offset = position_from_depth(pixel, depth_m) - position;
        float far = length(offset);
        bool counts = depth_m > 0.0 && (params.distance == 0.0 || far < params.distance);
        vec2 within = vec2(dot(offset, slice.across), dot(offset, slice.to_eye));
        float cosine = within.y * inversesqrt(max(dot(within, within), 1e-30));
        float found = counts ? mix(low, cosine, 1.0 / (1.0 + params.falloff * far)) : low;
        highest = found > highest ? found : mix(highest, max(found, low), params.thin);
    }
    return highest;
}

// ∫ of one half of a slice, from the way to the eye to the horizon at an angle h, with the normal
// at γ: equation 7 of the paper, without the slice's length.
float arc(float h, float normal_angle) {
    return 0.25
        * (cos(normal_angle) - cos(2.0 * h - normal_angle) + 2.0 * h * sin(normal_angle));
}

void main() {
    ivec2 texel = ivec2(gl_GlobalInvocationID.xy);
    if (!is_gathered(texel)) return;
    Surface surface;
    if (!read_receiver(texel, surface)) {
        imageStore(indirect_diffuse, texel, vec4(0.0));
        return;
    }
    ivec2 place = place_of(texel);
    vec3 offset = surface.position_ws - frame.eye_ws.xyz, normal = surface.shading_normal;
    vec3 to_eye = normalize(-offset);
    // The largest ball around the surface looks so large in the picture [px].
    float depth = dot(offset, frame.ray_forward.xyz), radius = params.distance;
    float squared = max(depth * depth - radius * radius, 0.25 * depth * depth);
    float scale = 0.5 * float(frame.size_px.y) / length(frame.ray_up.xyz);
    float reach = radius > 0.0 ? radius * inversesqrt(squared) * scale : 1e9;
    bool is_alone = (params.pattern & 0xffffu) == 0x101u;
    vec2 turned = is_alone ? unit_numbers(pcg3(uvec3(place, frame.walk.x))).xy
                           : interleaved_offset(place, params.pattern, frame.walk.x);
    mat3 around = frame_around(to_eye);
    vec2 middle = vec2(pixel_of(place)) + 0.5;
    float visibility = 0.0;
    for (uint i = 0u; i < params.slices; ++i) {
        float angle = PI * (float(i) + turned.x) / float(params.slices);
        vec3 across = around * vec3(cos(angle), sin(angle), 0.0);
        vec2 direction = picture_direction(offset, across);
        vec2 in_slice = vec2(dot(normal, across), dot(normal, to_eye));
        vec3 axis = cross(across, to_eye);
        float aside = dot(normal, axis);
        vec2 lean = aside / max(dot(in_slice, in_slice), 0.01) * in_slice;
        Slice slice = Slice(across + lean.x * axis, to_eye + lean.y * axis);
        float normal_angle = atan(in_slice.x, in_slice.y);
        float low_ahead = cos(min(normal_angle + HALF_PI, PI)),
              low_behind = cos(max(normal_angle - HALF_PI, -PI));
        float jitter = fract(turned.y + float(i) * 0.618034);
        float ahead = horizon(
            surface.position_ws, slice, middle, direction, reach, low_ahead, jitter);
        float behind = horizon(
            surface.position_ws, slice, middle, -direction, reach, low_behind, jitter);
        float h_ahead = min(acos(clamp(ahead, -1.0, 1.0)), normal_angle + HALF_PI);
        float h_behind = max(-acos(clamp(behind, -1.0, 1.0)), normal_angle - HALF_PI);
        visibility +=
            length(in_slice) * (arc(h_ahead, normal_angle) + arc(h_behind, normal_angle));
    }
    // One slice may see more than 1: that is right in the mean over pixels and slices.
    visibility /= float(params.slices);
    vec3 irradiance = params.has_sky == 0u
        ? vec3(0.0)
        : PI * visibility * environment_around(normal, PI);
    imageStore(indirect_diffuse, texel, vec4(irradiance, visibility));
}
