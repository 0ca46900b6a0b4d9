// What motion is measured against: the frame before.
#ifndef LUMIVOX_MOTION
#define LUMIVOX_MOTION

#include "shared/frame.glsl"

// Copies of dynamic models' vertices, as the frame before showed them.
layout(std430, set = 1, binding = 0) readonly buffer PreviousVertices {
    Vertex previous_vertices[];
};

layout(push_constant) uniform MotionParams {
    mat4 previous_clip_from_world;
    uint has_previous;        // 1 where there is a frame before
    uint has_moved;           // 1 where the draw's vertices have moved since
    uint first_copy;          // from the index of a vertex to that of its copy, modulo 2^32
} motion;

// Where a vertex was in the frame before [m].
vec3 previous_position(uint index, vec3 position) {
    return motion.has_moved != 0u ? previous_vertices[index + motion.first_copy].position
                                  : position;
}

#endif
