#version 460
#extension GL_GOOGLE_include_directive : require
// svo.link_neighbours: index + 1 of the neighbours towards −x, −y and −z of the tiles that a
// level's nodes lead to, 0 where there is none. A neighbour hangs on the same tile, or on that
// tile's own neighbour, which the level before has found. A thread 16 tiles.
layout(local_size_x = 64) in;

#include "gi/voxel_cones/svo/pool.glsl"

layout(std430, set = 1, binding = 0) restrict readonly buffer Levels { Level levels[]; };
layout(std430, set = 1, binding = 1) restrict readonly buffer Nodes { uint nodes[]; };
layout(std430, set = 1, binding = 2) restrict buffer Neighbours { uint neighbours[]; };

layout(push_constant) uniform LevelParams { uint level; uint first_child; } params;

// The word of a tile; that of one without children where they come before `first_child` in the
// pool.
uint word_of(uint tile) {
    uint word = nodes[tile];
    return word >> 8 < params.first_child ? 0u : word;
}

// The word of the neighbour along an axis of a tile; that of a tile without children where there is
// none.
uint word_before(uint tile, uint axis) {
    uint before = neighbours[3u * tile + axis];
    return before == 0u ? 0u : word_of(before - 1u);
}

void link(uint tile) {
    uint own = word_of(tile), child = own >> 8;
    uvec3 before = uvec3(0u);
    if (tile == 0u) {
        // The root has none.
        for (uint axis = 0u; axis < 3u; ++axis) neighbours[axis] = 0u;
    } else {
        before = uvec3(word_before(tile, 0u), word_before(tile, 1u), word_before(tile, 2u));
    }
    for (uint node = 0u; node < 8u; ++node) {
        if (!has_child(own, node)) continue;
        for (uint axis = 0u; axis < 3u; ++axis) {
            uint word = (node >> axis & 1u) != 0u ? own : before[axis], beside = node ^ 1u << axis;
            neighbours[3u * child + axis] =
                has_child(word, beside) ? child_of(word, beside) + 1u : 0u;
        }
        ++child;
    }
}

void main() {
    Level level = levels[params.level];
    uint group = linear_group(gl_WorkGroupID);
    for (uint i = 0u; i < TILES_PER_THREAD; ++i) {
        uint index = TILES_PER_GROUP * group + 64u * i + gl_LocalInvocationIndex;
        if (index < level.count) link(level.first + index);
    }
}
