#version 460
#extension GL_GOOGLE_include_directive : require
// voxel.fragments, methods `raster` and `raster-hw`: one invocation is one column of voxels along
// the triangle's dominant axis.
#include "gi/shared/voxel/build/emit.glsl"

layout(location = 0) flat in uint triangle_index;

// Appends a fragment for every touched voxel of one column along the dominant axis; `column` is
// relative to s.base.
void voxelize_column(TriangleSetup s, uint triangle, ivec2 column) {
    if (!touches_column(s, column)) return;
    ivec2 range = depth_range(s, column);
    Surface surface = surface_of(s);
    for (int z = range.x; z <= range.y; ++z) {
        if (touches(s, ivec3(column, z)))
            emit_fragment(s, surface, triangle, ivec3(column, z), reserve(1u));
    }
}

void main() {
    TriangleSetup s;
    if (!fetch_triangle(triangle_index, s)) return;
    ivec2 column = ivec2(gl_FragCoord.xy) - s.base.xy;
    if (any(lessThan(column, s.low.xy)) || any(greaterThan(column, s.high.xy))) return;
    voxelize_column(s, triangle_index, column);
}
