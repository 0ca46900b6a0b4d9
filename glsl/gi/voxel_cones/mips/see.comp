#version 460
#extension GL_GOOGLE_include_directive : require
#include "gi/shared/cone/see.glsl"
#include "gi/voxel_cones/mips/volume.glsl"
