#version 460
#extension GL_GOOGLE_include_directive : require
// prt.light_compressed: irradiance of points from that of their clusters,
// E = M⁰·L + Σ w_i Mⁱ·L (Rust: prt::compress), before it is clamped. A thread a point.
layout(local_size_x = 64) in;

// half floats in pairs: a word of all points, then the next word of all
layout(std430, set = 1, binding = 0) restrict readonly buffer Weights { uint weight_words[]; };
// four points a word
layout(std430, set = 1, binding = 1) restrict readonly buffer Clusters { uint point_clusters[]; };
// rgb: of the mean of a cluster, then of its vectors
layout(std430, set = 1, binding = 2) restrict readonly buffer ClusterLight {
    vec4 cluster_light[];
};
// rgb: irradiance [W/m²]; w: ambient visibility
layout(std430, set = 1, binding = 3) restrict buffer PointLight { vec4 point_light[]; };

layout(push_constant) uniform CompressedLightParams {
    uint first_point;      // of this buffer
    uint point_count;
    uint vector_count;
} params;

void main() {
    uint group = gl_WorkGroupID.x + gl_WorkGroupID.y * 65535u;
    uint own = group * 64u + gl_LocalInvocationID.x;
    if (own >= params.point_count) return;
    uint point = params.first_point + own;
    uint cluster = bitfieldExtract(point_clusters[point / 4u], int(point % 4u) * 8, 8);
    uint row = cluster * (1u + params.vector_count);
    vec3 sum = cluster_light[row].rgb;
    uint word = own;
    for (uint i = 0u; i < params.vector_count; i += 2u) {
        vec2 weights = unpackHalf2x16(weight_words[word]);
        sum += weights.x * cluster_light[row + 1u + i].rgb;
        if (i + 1u < params.vector_count) sum += weights.y * cluster_light[row + 2u + i].rgb;
        word += params.point_count;
    }
    point_light[point] = vec4(sum, point_light[point].w);
}
