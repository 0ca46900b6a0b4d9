// Two triangles that cover the whole target, without vertex buffers.
#version 460

void main() {
    vec2 corner = vec2(gl_VertexIndex == 1 || gl_VertexIndex == 3 || gl_VertexIndex == 4,
        gl_VertexIndex == 2 || gl_VertexIndex == 4 || gl_VertexIndex == 5);
    gl_Position = vec4(2.0 * corner - 1.0, 0.5, 1.0);
}
