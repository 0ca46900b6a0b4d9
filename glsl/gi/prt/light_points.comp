#version 460
#extension GL_GOOGLE_include_directive : require
// prt.light_points: irradiance of points from their transfer, E = Σ L_i T_i (Rust: prt::transfer),
// before it is clamped. A thread a row: one of each point.
// prt.light_lobes: the same for the coefficients of the radiance at points (Rust: prt::lobes).
// prt.light_clusters: the same for the rows of clusters (Rust: prt::compress).
layout(local_size_x = 64) in;

// red, green and blue of a function after the other, half floats in pairs: a word of all rows,
// then the next word of all
layout(std430, set = 1, binding = 0) restrict readonly buffer Transfer { uint transfer_words[]; };
// rgb: the light, a row a function
layout(std430, set = 1, binding = 1) restrict readonly buffer LightRows { vec4 light[]; };
// rgb: irradiance [W/m²] or a coefficient; w: kept
layout(std430, set = 1, binding = 2) restrict buffer PointLight { vec4 point_light[]; };

layout(push_constant) uniform PointLightParams {
    uint first_row;        // of this buffer
    uint row_count;
    uint first_function;   // of a row, among the light's
    uint function_count;   // even: of an odd number the last is dark
    uint adds;             // 1: to the light that rows have
} params;

void main() {
    uint group = gl_WorkGroupID.x + gl_WorkGroupID.y * 65535u;
    uint own = group * 64u + gl_LocalInvocationID.x;
    if (own >= params.row_count) return;
    uint row = params.first_row + own;
    vec4 before = point_light[row];
    vec3 sum = params.adds != 0u ? before.rgb : vec3(0.0);
    uint word = own;
    for (uint i = 0u; i < params.function_count; i += 2u) {
        vec2 rg = unpackHalf2x16(transfer_words[word]);
        vec2 br = unpackHalf2x16(transfer_words[word + params.row_count]);
        vec2 gb = unpackHalf2x16(transfer_words[word + 2u * params.row_count]);
        uint f = params.first_function + i;
        sum += light[f].rgb * vec3(rg, br.x) + light[f + 1u].rgb * vec3(br.y, gb);
        word += 3u * params.row_count;
    }
    point_light[row] = vec4(sum, before.w);
}
