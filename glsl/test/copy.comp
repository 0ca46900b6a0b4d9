// Copies one word each: a pass that only reads one buffer and only writes another.
#version 460
layout(local_size_x = 64) in;
layout(set = 1, binding = 0, std430) restrict readonly buffer Source { uint source[]; };
layout(set = 1, binding = 1, std430) restrict writeonly buffer Target { uint target[]; };
layout(push_constant) uniform Params { uint count; } params;

void main() {
    uint index = gl_GlobalInvocationID.x;
    if (index < params.count) {
        target[index] = source[index];
    }
}
