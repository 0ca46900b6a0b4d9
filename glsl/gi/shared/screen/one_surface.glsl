// Whether two pixels show one surface. The including pass declares `view_depth` and `normals`.
#ifndef LUMIVOX_ONE_SURFACE
#define LUMIVOX_ONE_SURFACE

#include "shared/receiver.glsl"

// Height [m] of a pixel that shows this place.
float footprint_of(vec3 position) {
    return length(position - frame.eye_ws.xyz) * 2.0 * length(frame.ray_up.xyz)
        / float(frame.size_px.y);
}

// A pixel's surface, for its neighbours. Off its plane are points at view depth d of place q by
// d (along.z + along.xy · q) − eye_m: n · (eye + d ray(q)) is linear in q.
struct Own {
    vec3 along;
    float eye_m;         // of its plane from the eye
    vec3 shading_normal;
    float off_plane_m;   // at most
    float cosine;        // of shading normals, at least
};

Own own_surface(Surface surface, float plane_tolerance, float normal_cosine) {
    vec3 n = surface.geometric_normal;
    vec2 pixel = 2.0 / vec2(frame.size_px.xy);
    vec2 slope = vec2(dot(n, frame.ray_right.xyz), -dot(n, frame.ray_up.xyz));
    // Of pixel_of, which is linear too.
    vec2 first = vec2(pixel_of(ivec2(0))), step = vec2(pixel_of(ivec2(1))) - first;
    vec3 along = vec3(pixel * slope * step,
        dot(n, frame.ray_forward.xyz) + dot((first + 0.5) * pixel - 1.0, slope));
    return Own(along, dot(n, surface.position_ws - frame.eye_ws.xyz), surface.shading_normal,
        plane_tolerance * footprint_of(surface.position_ws), normal_cosine);
}

bool is_on_plane(Own own, ivec2 pixel, float depth_m) {
    float off_m = depth_m * (own.along.z + dot(own.along.xy, vec2(pixel))) - own.eye_m;
    return depth_m > 0.0 && abs(off_m) <= own.off_plane_m;
}

bool has_normal(Own own, uint packed) {
    vec3 other = direction_from_octahedral(unpackSnorm2x16(packed));
    // Squares that keep their sign save the root of the other's length.
    float along = dot(own.shading_normal, other);
    return along * abs(along) >= own.cosine * abs(own.cosine) * dot(other, other);
}

bool shares_surface(Own own, ivec2 pixel) {
    float depth_m = texelFetch(sampler2D(view_depth, nearest_clamp), pixel, 0).r;
    return is_on_plane(own, pixel, depth_m)
        && has_normal(own, texelFetch(usampler2D(normals, nearest_clamp), pixel, 0).g);
}

#endif
