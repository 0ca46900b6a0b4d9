// The albedo of one material, at its centre, into one element.
#version 460
layout(local_size_x = 1) in;
layout(set = 0, binding = 3) uniform sampler linear_repeat;
layout(set = 1, binding = 0, std430) restrict writeonly buffer Target { vec4 target[]; };
layout(set = 2, binding = 0) uniform texture2D albedo;
layout(push_constant) uniform Params { uint index; } params;

void main() {
    target[params.index] = textureLod(sampler2D(albedo, linear_repeat), vec2(0.5), 0.0);
}
