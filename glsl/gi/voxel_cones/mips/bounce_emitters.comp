#version 460
#extension GL_GOOGLE_include_directive : require
#define SPACE_BINDING 3
#define SPACE_CONSTANT 0
#include "gi/shared/voxel/trace/bounce_emitters.glsl"
#include "gi/shared/voxel/trace/lit_grid.glsl"
