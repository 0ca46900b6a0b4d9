#version 460
#extension GL_GOOGLE_include_directive : require
// ray_traced.mirror: indirect specular radiance L_s of glossy surfaces, by paths along directions
// of the lobe's visible normals.
layout(local_size_x = 8, local_size_y = 8) in;

#include "gi/shared/paths/bindings.glsl"

layout(set = 1, binding = 9) uniform texture2D view_depth;
layout(set = 1, binding = 10) uniform utexture2D normals;
layout(set = 1, binding = 11) uniform texture2D specular;
layout(set = 1, binding = 12, rgba32f) uniform restrict image2D indirect_specular;

#include "gi/ray_traced/params.glsl"

#define SPACE_BINDING 13
#define MIRROR_BOUNCES params.bounces
#include "gi/shared/paths/mirror.glsl"
