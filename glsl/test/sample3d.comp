// Samples a 3D texture at its centre, at each mip, through the linear sampler of set 0.
#version 460
layout(local_size_x = 1) in;
layout(set = 0, binding = 1) uniform sampler linear_clamp;
layout(set = 1, binding = 0) uniform texture3D volume;
layout(set = 1, binding = 1, std430) restrict writeonly buffer Target { vec4 target[]; };

void main() {
    float mip = float(gl_GlobalInvocationID.x);
    target[gl_GlobalInvocationID.x] = textureLod(sampler3D(volume, linear_clamp), vec3(0.5), mip);
}
