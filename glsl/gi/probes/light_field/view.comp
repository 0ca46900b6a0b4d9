#version 460
#extension GL_GOOGLE_include_directive : require
// light_field.view: probes as spheres as the camera sees them, by what they see; or the images of
// their maps. A thread a pixel.
layout(local_size_x = 8, local_size_y = 8) in;

layout(set = 1, binding = 0) uniform texture2D view_depth;
layout(set = 1, binding = 1) uniform utexture2D normals;
layout(set = 1, binding = 2, rgba32f) uniform restrict writeonly image2D seen;

#include "gi/probes/lookup_row.glsl"

layout(push_constant) uniform FieldViewParams {
    LookupRow lookup;
    float radius_m;     // of a sphere
    float reach;        // a white distance [cells]
    uint view;          // one of gi::probes::light_field::view::VIEWS
    uint probe_count;
} params;

layout(constant_id = 6) const uint FIELD_TEXELS = 64;    // edge of a map

layout(set = 1, binding = 8) uniform utexture2D field_surfaces;
layout(set = 1, binding = 9) uniform utexture2D field_radiance;

#include "shared/gbuffer.glsl"
#define LOOKUP_BINDING 3
#define LOOKUP_CONSTANT 0
#include "gi/probes/lookup.glsl"
#include "gi/probes/field_texels.glsl"
#include "shared/packing.glsl"

const uint RADIANCE = 0u, DISTANCES = 1u, RADIANCE_ATLAS = 2u;
// These views of irradiance are not there.
const uint IRRADIANCE = 0xffffffffu, SIGHT = 0xfffffffeu;

vec4 shown_of_texel(ivec2 texel, bool is_light) {
    if (is_light) {
        uint packed = texelFetch(usampler2D(field_radiance, nearest_clamp), texel, 0).r;
        return vec4(unpack_rgbe(packed), 1.0);
    }
    uint packed = texelFetch(usampler2D(field_surfaces, nearest_clamp), texel, 0).r;
    return vec4(vec3(min(unpack_field_texel(packed).distance / params.reach, 1.0)), 1.0);
}

// What a sphere shows where its normal points to `normal`: the texel of that direction.
vec4 shown_of_probe(uint probe, vec3 normal) {
    vec2 at = (octahedral_from_unit(normal) * 0.5 + 0.5) * float(FIELD_TEXELS);
    ivec2 texel = clamp(ivec2(at), ivec2(0), ivec2(FIELD_TEXELS - 1u));
    ivec2 map = field_map(probe, params.lookup.columns, FIELD_TEXELS);
    return shown_of_texel(map + texel, params.view == RADIANCE);
}

#include "gi/probes/view.glsl"

// A texel of an image of maps, which fills the picture as far as its shape allows.
vec4 shown_of_atlas(ivec2 pixel) {
    ivec2 size = textureSize(usampler2D(field_surfaces, nearest_clamp), 0);
    vec2 texels = vec2(size) / vec2(frame.size_px.xy);
    ivec2 texel = ivec2((vec2(pixel) + 0.5) * max(texels.x, texels.y));
    if (any(greaterThanEqual(texel, size))) return vec4(0.0);
    uint probe = probe_of_texel(texel, params.lookup.columns, FIELD_TEXELS);
    if (probe >= params.probe_count) return vec4(0.0);
    return shown_of_texel(texel, params.view == RADIANCE_ATLAS);
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, ivec2(frame.size_px.xy)))) return;
    bool is_atlas = params.view >= RADIANCE_ATLAS;
    imageStore(seen, pixel, is_atlas ? shown_of_atlas(pixel) : shown_of_pixel(pixel));
}
