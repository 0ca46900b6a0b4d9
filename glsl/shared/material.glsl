// Set 2: the textures of one material, bound per batch. Absent textures are one white texel.
#ifndef LUMIVOX_MATERIAL
#define LUMIVOX_MATERIAL

layout(set = 2, binding = 0) uniform texture2D albedo_texture;
layout(set = 2, binding = 1) uniform texture2D emission_texture;
layout(set = 2, binding = 2) uniform texture2D normal_texture;
layout(set = 2, binding = 3) uniform texture2D mask_texture;
layout(set = 2, binding = 4) uniform texture2D lobe_texture; // rgb: factor of F0; a: of roughness

#endif
