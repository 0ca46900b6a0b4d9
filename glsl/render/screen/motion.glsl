// What motion is measured against: the frame before.
#ifndef LUMIVOX_MOTION
#define LUMIVOX_MOTION

#include "shared/frame.glsl"

// Where dynamic models' vertices were in the frame before [m], three numbers a vertex.
layout(std430, set = 1, binding = 0) readonly buffer PreviousPositions {
    float previous_positions[];
};

layout(push_constant) uniform MotionParams {
    mat4 previous_clip_from_world;
    uint has_previous;        // 1 where there is a frame before
    uint has_moved;           // 1 where the draw's vertices have moved since
    uint first_copy;          // from the index of a vertex to that of its copy, modulo 2^32
} before;

// Where a vertex was in the frame before [m].
vec3 previous_position(uint vertex, vec3 position) {
    if (before.has_moved == 0u) return position;
    uint first = 3u * (vertex + before.first_copy);
    return vec3(previous_positions[first], previous_positions[first + 1u],
        previous_positions[first + 2u]);
}

#endif
