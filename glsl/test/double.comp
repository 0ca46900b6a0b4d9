// Doubles every element: the smallest pass.
#version 460
layout(local_size_x_id = 0) in;
layout(set = 1, binding = 0, std430) restrict buffer Values { uint values[]; };
layout(push_constant) uniform Params { uint count; } params;

void main() {
    uint index = gl_GlobalInvocationID.x;
    if (index < params.count) {
        values[index] = 2u * values[index] + 1u;
    }
}
