#version 460
#extension GL_GOOGLE_include_directive : require
// prt.light_compressed: irradiance of points, or coefficients of their radiance, from those of
// their clusters, E = M⁰·L + Σ w_i Mⁱ·L (Rust: prt::compress), before it is clamped. A thread an
// output of a point.
layout(local_size_x = 64) in;

// half floats in pairs: a word of all points, then the next word of all
layout(std430, set = 1, binding = 0) restrict readonly buffer Weights { uint weight_words[]; };
// four points a word
layout(std430, set = 1, binding = 1) restrict readonly buffer Clusters { uint point_clusters[]; };
// rgb: of the mean of a cluster, then of its vectors, all outputs of each
layout(std430, set = 1, binding = 2) restrict readonly buffer ClusterLight {
    vec4 cluster_light[];
};
// rgb: irradiance [W/m²] or a coefficient; w: kept
layout(std430, set = 1, binding = 3) restrict buffer PointLight { vec4 point_light[]; };

layout(push_constant) uniform CompressedLightParams {
    uint first_point;      // of this buffer
    uint point_count;
    uint vector_count;
    uint output_count;     // of a point
} params;

void main() {
    uint group = gl_WorkGroupID.x + gl_WorkGroupID.y * 65535u;
    uint thread = group * 64u + gl_LocalInvocationID.x;
    uint own = thread / params.output_count, outputs = params.output_count;
    if (own >= params.point_count) return;
    uint point = params.first_point + own, output_index = thread % outputs;
    uint cluster = bitfieldExtract(point_clusters[point / 4u], int(point % 4u) * 8, 8);
    uint row = cluster * (1u + params.vector_count) * outputs + output_index;
    vec3 sum = cluster_light[row].rgb;
    uint word = own;
    for (uint i = 0u; i < params.vector_count; i += 2u) {
        vec2 weights = unpackHalf2x16(weight_words[word]);
        sum += weights.x * cluster_light[row + (1u + i) * outputs].rgb;
        if (i + 1u < params.vector_count)
            sum += weights.y * cluster_light[row + (2u + i) * outputs].rgb;
        word += params.point_count;
    }
    uint place = point * outputs + output_index;
    point_light[place] = vec4(sum, point_light[place].w);
}
