// Light from points of surfaces that emit. The including pass defines PARTS_BINDING.
#ifndef LUMIVOX_TRACE_EMITTERS
#define LUMIVOX_TRACE_EMITTERS

// A part of the emitting surface. Parts are drawn by their power.
struct GpuEmitterPart {
    vec4 corner_before;   // xyz: a corner [m]; w: share of all power that parts before it have
    vec4 edge_density;    // xyz: from there to the second [m]; w: density of drawn points [1/m²]
    vec4 edge;            // xyz: to the third [m]
    vec4 radiance;        // rgb: emitted to the front [W/(m² sr)]
};

layout(std430, set = 1, binding = PARTS_BINDING) restrict readonly buffer EmitterParts {
    GpuEmitterPart emitter_parts[];
};

// How many points are compared for each ray.
const uint CANDIDATES = 4u;

const vec3 LUMINANCE_WEIGHTS = vec3(0.2126, 0.7152, 0.0722);

// A point that a ray goes to.
struct EmitterPoint {
    vec3 position;     // [m]
    vec3 normal;
    vec3 irradiance;   // on the receiver where nothing hides it, over the density of points [W/m²]
};

// The part that a number of [0, 1) draws: the last one of which parts before it have no more power.
uint part_at(float u, uint part_count) {
    uint first = 0u, end = part_count;
    for (uint turn = 0u; turn < 32u && end - first > 1u; ++turn) {
        uint middle = (first + end) / 2u;
        if (emitter_parts[middle].corner_before.w <= u) {
            first = middle;
        } else {
            end = middle;
        }
    }
    return first;
}

// What a point of the part that `u` draws sends to a surface, `at` being two numbers of [0, 1).
// `least` is the least distance squared that counts [m²].
EmitterPoint point_of_part(float u, vec2 at, uint part_count, vec3 receiver_ws, vec3 normal,
    vec3 geometric_normal, float least) {
    GpuEmitterPart part = emitter_parts[part_at(u, part_count)];
    float root = sqrt(at.x);
    EmitterPoint point;
    point.position = part.corner_before.xyz + root * (1.0 - at.y) * part.edge_density.xyz
        + root * at.y * part.edge.xyz;
    point.normal = normalize(cross(part.edge_density.xyz, part.edge.xyz));
    vec3 way = point.position - receiver_ws;
    float squared = dot(way, way);
    vec3 direction = way * inversesqrt(max(squared, 1e-20));
    float cosine = dot(geometric_normal, direction) > 0.0 ? max(dot(normal, direction), 0.0) : 0.0;
    float leaving = max(-dot(point.normal, direction), 0.0);
    point.irradiance = part.radiance.rgb
        * (cosine * leaving / (max(squared, least) * part.edge_density.w));
    return point;
}

// One of some points, drawn in proportion to what it sends where nothing hides it, and weighted so
// that the mean is that of all (resampled importance sampling, Talbot et al. 2005). `u`, `at` and
// `choice` are numbers of [0, 1).
EmitterPoint chosen_point(float u, vec2 at, float choice, uint part_count, vec3 receiver_ws,
    vec3 normal, vec3 geometric_normal, float least) {
    EmitterPoint chosen = EmitterPoint(vec3(0.0), vec3(0.0, 1.0, 0.0), vec3(0.0));
    float sum = 0.0, own = 0.0;
    for (uint i = 0u; i < CANDIDATES; ++i) {
        float turned = fract(u + float(i) / float(CANDIDATES));
        vec2 within = fract(at + float(i) * vec2(0.7548776662466927, 0.5698402909980532));
        EmitterPoint point = point_of_part(
            turned, within, part_count, receiver_ws, normal, geometric_normal, least);
        float weight = dot(point.irradiance, LUMINANCE_WEIGHTS);
        if (!(weight > 0.0)) continue;
        sum += weight;
        // The number is used again: what is left of it is as even.
        float share = weight / sum;
        if (choice < share) {
            chosen = point;
            own = weight;
            choice /= share;
        } else {
            choice = (choice - share) / (1.0 - share);
        }
    }
    if (own > 0.0) chosen.irradiance *= sum / (own * float(CANDIDATES));
    return chosen;
}

// The point that ray number `i` of `count` goes to. Rays draw parts of the surface in their order,
// and so evenly over it; `offset` are two numbers of [0, 1) that neighbours have differently.
EmitterPoint ray_point(uint i, uint count, vec2 offset, uint part_count, vec3 receiver_ws,
    vec3 normal, vec3 geometric_normal, float least) {
    // Moved, so that of parts of equal power no number is between two.
    float u = fract((float(i) + offset.x) / float(count) + 0.6180339887498949);
    vec2 at = fract(offset + float(i) * vec2(0.8191725133961645, 0.6710436067037893));
    float choice = fract(offset.y + float(i) * 0.6180339887498949);
    return chosen_point(
        u, at, choice, part_count, receiver_ws, normal, geometric_normal, least);
}

#endif
