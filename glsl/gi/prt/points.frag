#version 460
#extension GL_GOOGLE_include_directive : require
// prt.points: irradiance and ambient visibility of what each pixel shows, between points.
#include "gi/prt/drawn.glsl"

layout(location = 0) out vec4 seen;   // rgb: irradiance [W/m²]; a: ambient visibility

layout(constant_id = 0) const uint CLAMP = 1;   // no negative irradiance

layout(std430, set = 1, binding = 2) restrict readonly buffer PointLight { vec4 point_light[]; };

void main() {
    bool is_gone = is_cut();
    uvec3 points;
    vec3 shares;
    seen = vec4(0.0);
    if (find_points(points, shares)) {
        for (int i = 0; i < 3; ++i) seen += shares[i] * point_light[points[i]];
        if (CLAMP != 0u) seen.rgb = max(seen.rgb, vec3(0.0));
    }
    if (is_gone) discard;
}
