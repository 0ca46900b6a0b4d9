#version 460
// voxel.fragments, methods `raster` and `raster-hw`: hands the vertex number on; the geometry
// shader fetches the triangle.
layout(location = 0) flat out uint vertex_index;

void main() {
    vertex_index = uint(gl_VertexIndex);
    gl_Position = vec4(0.0, 0.0, 0.0, 1.0);
}
