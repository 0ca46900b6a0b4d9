#version 460
#extension GL_EXT_samplerless_texture_functions : require
// A picture in a window: from light to colours, texel by texel.

// Whether what the window shows is encoded to sRGB as it is written.
layout(constant_id = 0) const uint ENCODES = 0;

layout(set = 0, binding = 0) uniform texture2D light;

layout(location = 0) out vec4 color;

layout(push_constant) uniform Params {
    vec2 corner_px;
    vec2 texels_per_px;
    // The last row and column that are drawn.
    ivec2 last;
    float exposure;
    // 0: none, 1: Reinhard.
    uint tone_map;
} params;

// By code of 8 bits, the smallest light that has it, and that has the next (x and y). In a buffer,
// as drivers copy constant arrays for each pixel.
layout(set = 0, binding = 1, std140) uniform Codes {
    vec4 least[256];
} codes;

// What is written for light: exactly the codes that the host writes into PNG files.
float shown(float light) {
    if (!(light > 0.0)) return 0.0;
    // A guess, as the power of a device may miss it by one.
    float encoded = light <= 0.0031308 ? 12.92 * light : 1.055 * pow(light, 1.0 / 2.4) - 0.055;
    uint code = uint(min(255.0 * encoded + 0.5, 255.0));
    vec2 least = codes.least[code].xy;
    if (light < least.x) code--;
    if (light >= least.y) code++;
    if (ENCODES == 0u || code == 0u || code == 255u) return float(code) / 255.0;
    // Light that has the code, whoever encodes it.
    least = codes.least[code].xy;
    return 0.5 * (least.x + least.y);
}

void main() {
    ivec2 texel = ivec2((gl_FragCoord.xy - params.corner_px) * params.texels_per_px);
    precise vec3 linear = params.exposure
        * texelFetch(light, clamp(texel, ivec2(0), params.last), 0).rgb;
    if (params.tone_map == 1u) {
        // Reinhard et al. 2002, equation 4, white at 4.
        float luminance = max(dot(linear, vec3(0.2126, 0.7152, 0.0722)), 0.0);
        linear *= (1.0 + luminance / 16.0) / (1.0 + luminance);
    }
    color = vec4(shown(linear.r), shown(linear.g), shown(linear.b), 1.0);
}
