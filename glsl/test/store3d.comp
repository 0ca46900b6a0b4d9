// Stores a ramp along x into one mip of a 3D image.
#version 460
layout(local_size_x = 4, local_size_y = 4, local_size_z = 4) in;
layout(set = 1, binding = 0, rgba16f) uniform restrict writeonly image3D volume;

void main() {
    ivec3 texel = ivec3(gl_GlobalInvocationID);
    if (all(lessThan(texel, imageSize(volume)))) {
        imageStore(volume, texel, vec4(float(texel.x), 1.0, 0.0, 1.0));
    }
}
