// Texels of the reflective shadow maps as places that reflect light. The including pass declares
// `light_views`, `shadow_maps` and `rsm_normal`.
#ifndef LUMIVOX_LPV_REFLECTED
#define LUMIVOX_LPV_REFLECTED

#include "shared/cascade.glsl"
#include "shared/light_view.glsl"
#include "shared/packing.glsl"

struct Reflected {
    bool is_there;
    vec3 position;   // [m]
    vec3 normal;     // unit, on the lit side
    ivec3 texel;     // x, y, layer
    float extent;    // across a parallel beam: A [m²]; seen from any other light: Ω [sr]
    float area;      // of the surface [m²]
};

// What the middle texel of a square of `stride` texels sees, and the extent of the whole square.
Reflected read_reflected(ivec2 square, int layer, LightView view, int stride) {
    int size = int(view.light.y);
    ivec2 first = square * stride, end = min(first + stride, ivec2(size));
    Reflected found;
    found.texel = ivec3((first + end) / 2, layer);
    float stored = any(greaterThanEqual(first, ivec2(size)))
        ? 0.0
        : texelFetch(sampler2DArray(shadow_maps, nearest_clamp), found.texel, 0).r;
    found.is_there = stored != 0.0 && !is_in_finer_cascade(layer, view, found.texel.xy);
    if (!found.is_there) return found;
    bool parallel = view.origin_kind.w == 0.0;
    vec2 map = (vec2(found.texel.xy) + 0.5) / float(size) * 2.0 - 1.0;
    vec3 across = map.x * view.right.xyz + map.y * view.down.xyz;
    vec3 ray = parallel ? view.forward.xyz : view.forward.xyz + across;
    vec3 start = parallel ? view.origin_kind.xyz + across : view.origin_kind.xyz;
    vec3 way = ray * map_depth(view, stored, view.right.w);
    found.position = start + way;
    found.normal =
        unpack_unit(texelFetch(usampler2DArray(rsm_normal, nearest_clamp), found.texel, 0).r);
    if (dot(found.normal, ray) > 0.0) found.normal = -found.normal;

    // of the square about its own middle
    vec2 middle = vec2(first + end) / float(size) - 1.0, edges = vec2(end - first) / float(size);
    vec3 towards = view.forward.xyz + middle.x * view.right.xyz + middle.y * view.down.xyz;
    float squared = dot(towards, towards);
    found.extent = 4.0 * edges.x * edges.y * length(view.right.xyz) * length(view.down.xyz);
    if (!parallel) found.extent /= squared * sqrt(squared);
    float cosine = max(-dot(found.normal, normalize(ray)), 1e-6);
    found.area = found.extent * (parallel ? 1.0 : dot(way, way)) / cosine;
    return found;
}

#endif
