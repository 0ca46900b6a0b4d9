#version 460
#extension GL_GOOGLE_include_directive : require
#include "gi/shared/cone/view.glsl"
#include "gi/voxel_cones/svo/volume.glsl"
#include "gi/voxel_cones/svo/structure.glsl"
