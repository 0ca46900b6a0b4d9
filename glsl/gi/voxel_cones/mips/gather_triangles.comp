#version 460
#extension GL_GOOGLE_include_directive : require
#define SPACE_BINDING 8
#define SPACE_CONSTANT 3
#include "gi/shared/voxel/trace/gather_triangles.glsl"
#include "gi/shared/voxel/trace/lit_grid.glsl"
