#version 460
#extension GL_GOOGLE_include_directive : require
// voxel.list_tiles: lists the squares of BLOCK² tiles of the reflective shadow maps from which
// light can fall on voxels that are lit anew: a group of voxel.inject_rsm each. A thread a square.
layout(local_size_x = 8, local_size_y = 8) in;

#include "shared/light_view.glsl"
#include "gi/shared/voxel/light/tiles.glsl"

// edge of the block of texels that a thread of voxel.inject_rsm adds [texels]
layout(constant_id = 0) const uint BLOCK = 1;

layout(std430, set = 1, binding = 0) restrict readonly buffer LightViews {
    LightView light_views[];
};
layout(std430, set = 1, binding = 1) restrict readonly buffer TileDepths { vec2 tile_depths[]; };
// x + row (y + row · view)
layout(std430, set = 1, binding = 2) restrict buffer ListedTiles {
    uvec3 list_groups;
    uint list_count;
    uint list[];
};

layout(push_constant) uniform TileParams {
    vec4 grid;         // xyz: smallest corner of the grid [m]; w: voxel size [m]
    ivec4 piece;       // of the grid, whose voxels are lit: smallest corner and edge [voxels]
    ivec4 kept_low;    // box of voxels whose light stays as it is
    ivec4 kept_end;
} params;

// Light falls on voxels within two of its texel: its group's centre is within one, and the group's
// light reaches one further.
const float REACH = 3.0;

bool may_reach(vec3 low, vec3 high) {
    bool meets = all(lessThan(low - REACH, vec3(params.piece.xyz + params.piece.w)))
        && all(greaterThan(high + REACH, vec3(params.piece.xyz)));
    return meets
        && !(all(greaterThan(low - REACH, vec3(params.kept_low)))
            && all(lessThan(high + REACH, vec3(params.kept_end))));
}

void main() {
    uvec3 square = gl_GlobalInvocationID;
    LightView view = light_views[square.z];
    uint size = view.light.y, row = tile_row(size);
    if (any(greaterThanEqual(square.xy * BLOCK, uvec2(row)))) return;
    bool parallel = view.origin_kind.w == 0.0;
    bool reaches = false;
    for (uint i = 0u; i < BLOCK * BLOCK && !reaches; ++i) {
        uvec2 tile = BLOCK * square.xy + uvec2(i % BLOCK, i / BLOCK);
        if (any(greaterThanEqual(tile, uvec2(row)))) continue;
        vec2 depths = tile_depths[tile.x + row * (tile.y + row * square.z)];
        // A texel's place is linear in each of x, y and depth: its bounds are those of the ends.
        vec2 from = 2.0 * float(TILE) * vec2(tile) / float(size) - 1.0,
             to = 2.0 * float(TILE) * vec2(tile + 1u) / float(size) - 1.0;
        vec3 right_from = from.x * view.right.xyz, right_to = to.x * view.right.xyz,
             down_from = from.y * view.down.xyz, down_to = to.y * view.down.xyz,
             low = min(right_from, right_to) + min(down_from, down_to),
             high = max(right_from, right_to) + max(down_from, down_to);
        if (parallel) {
            vec3 near = view.forward.xyz * depths.x, far = view.forward.xyz * depths.y;
            low += min(near, far);
            high += max(near, far);
        } else {
            low += view.forward.xyz;
            high += view.forward.xyz;
            low = min(low * depths.x, low * depths.y);
            high = max(high * depths.x, high * depths.y);
        }
        vec3 corner = view.origin_kind.xyz - params.grid.xyz;
        low = (corner + low) / params.grid.w;
        high = (corner + high) / params.grid.w;
        reaches = depths.x <= depths.y && may_reach(low, high);
    }
    if (!reaches) return;
    uint at = atomicAdd(list_count, 1u);
    uint squares = (row + BLOCK - 1u) / BLOCK;
    list[at] = square.x + squares * (square.y + squares * square.z);
    atomicMax(list_groups.x, min(at + 1u, GROUPS_ALONG));
    atomicMax(list_groups.y, at / GROUPS_ALONG + 1u);
    atomicMax(list_groups.z, 1u);
}
