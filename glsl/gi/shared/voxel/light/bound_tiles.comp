#version 460
#extension GL_GOOGLE_include_directive : require
// voxel.bound_tiles: between which depths the surface of each tile of a reflective shadow map lies.
// A thread a tile.
layout(local_size_x = 8, local_size_y = 8) in;

#include "shared/light_view.glsl"
#include "gi/shared/voxel/light/tiles.glsl"

layout(std430, set = 1, binding = 0) restrict readonly buffer LightViews {
    LightView light_views[];
};
layout(set = 1, binding = 1) uniform texture2DArray shadow_maps;
// least and largest [m]; of an empty tile the least is larger
layout(std430, set = 1, binding = 2) restrict writeonly buffer TileDepths { vec2 tile_depths[]; };

void main() {
    uvec3 tile = gl_GlobalInvocationID;
    LightView view = light_views[tile.z];
    uint size = view.light.y, row = tile_row(size);
    if (any(greaterThanEqual(tile.xy, uvec2(row)))) return;
    vec2 depths = vec2(1e30, -1.0);
    for (uint i = 0u; i < TILE * TILE; ++i) {
        uvec2 texel = TILE * tile.xy + uvec2(i % TILE, i / TILE);
        if (any(greaterThanEqual(texel, uvec2(size)))) continue;
        float stored =
            texelFetch(sampler2DArray(shadow_maps, nearest_clamp), ivec3(texel, tile.z), 0).r;
        float depth_m = map_depth(view, stored, view.right.w);
        if (stored != 0.0) depths = vec2(min(depths.x, depth_m), max(depths.y, depth_m));
    }
    tile_depths[tile.x + row * (tile.y + row * tile.z)] = depths;
}
