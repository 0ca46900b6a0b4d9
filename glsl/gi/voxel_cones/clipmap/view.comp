#version 460
#extension GL_GOOGLE_include_directive : require
#include "gi/shared/cone/view.glsl"
#include "gi/voxel_cones/clipmap/volume.glsl"
#include "gi/voxel_cones/clipmap/structure.glsl"
