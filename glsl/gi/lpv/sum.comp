#version 460
#extension GL_GOOGLE_include_directive : require
// lpv.sum: the light of all octants, one slab of the volume each.
layout(local_size_x = 8, local_size_y = 8) in;

layout(set = 1, binding = 0, rgba16f) uniform restrict readonly image3D slabs;
layout(set = 1, binding = 1, rgba16f) uniform restrict writeonly image3D light;

layout(push_constant) uniform SumParams {
    ivec4 size;    // xyz: texels of the volume; w: slabs
} params;

void main() {
    ivec3 texel = ivec3(gl_GlobalInvocationID);
    if (any(greaterThanEqual(texel, params.size.xyz))) return;
    vec4 sum = vec4(0.0);
    for (int slab = 0; slab < params.size.w; ++slab)
        sum += imageLoad(slabs, texel + ivec3(0, 0, slab * params.size.z));
    imageStore(light, texel, sum);
}
