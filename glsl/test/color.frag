// One colour, from the push constants.
#version 460
layout(location = 0) out vec4 color;
layout(push_constant) uniform ColorParams { vec4 color; } params;

void main() {
    color = params.color;
}
