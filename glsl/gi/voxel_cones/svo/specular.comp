#version 460
#extension GL_GOOGLE_include_directive : require
#include "gi/shared/cone/specular.glsl"
#include "gi/voxel_cones/svo/volume.glsl"
