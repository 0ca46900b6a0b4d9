#version 460
#extension GL_GOOGLE_include_directive : require
#include "gi/shared/cone/gather.glsl"
#include "gi/voxel_cones/mips/volume.glsl"
