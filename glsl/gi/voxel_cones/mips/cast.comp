#version 460
#extension GL_GOOGLE_include_directive : require
#define SPACE_BINDING 2
#define SPACE_CONSTANT 0
#include "gi/shared/voxel/trace/cast.glsl"
#include "gi/shared/voxel/trace/lit_grid.glsl"
