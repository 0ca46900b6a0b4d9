#version 460
#extension GL_GOOGLE_include_directive : require
// lpv.leaf_structure: leaves of an octree. A seen surface has the colour of the leaf that its light
// is looked up in. Larger leaves are where there is nothing to see, so a plane is cut through the
// grid, with the leaves that it meets.
layout(local_size_x = 8, local_size_y = 8) in;

layout(std430, set = 1, binding = 0) restrict readonly buffer LeafOf { uint leaf_of[]; };
layout(std430, set = 1, binding = 1) restrict readonly buffer Leaves { uint leaves[]; };
layout(set = 1, binding = 2) uniform texture2D view_depth;
layout(set = 1, binding = 3) uniform utexture2D normals;
layout(set = 1, binding = 4, rgba32f) uniform restrict writeonly image2D seen;

#include "shared/gbuffer.glsl"
#include "gi/lpv/structure/surface.glsl"

layout(push_constant) uniform LeafStructureParams {
    CellGrid grid;
    float shift;   // off the surface [cells]
    uint from;     // the finest level that is shown
} params;

struct Leaf {
    vec3 low;      // its smallest corner [cells]
    float edge;    // [cells]
    uint level;
};

// Opacity of the plane.
const float CUT = 0.8;

Leaf leaf_at(ivec3 cell) {
    uint word = leaves[leaf_of[cell_index(params.grid, cell)]];
    uvec3 corner = uvec3(word, word >> 9, word >> 18) & 511u;
    uint level = word >> 27;
    return Leaf(vec3(corner), float(1u << level), level);
}

// Where a ray meets the plane that is cut through the grid [cells]: across the axis that the
// camera looks along most, halfway between it and the grid's far end. `normal` is the plane's.
float cut_at(vec3 origin, vec3 direction, out vec3 normal) {
    vec3 forward = frame.ray_forward.xyz, steep = abs(forward);
    int axis = steep.x >= steep.y && steep.x >= steep.z ? 0 : steep.y >= steep.z ? 1 : 2;
    float size = float(params.grid.size[axis]);
    float far = forward[axis] > 0.0 ? size : 0.0;
    normal = vec3(0.0);
    normal[axis] = 1.0;
    float plane = 0.5 * (clamp(origin[axis], 0.0, size) + far);
    return (plane - origin[axis]) / direction[axis];
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, ivec2(frame.size_px.xy)))) return;
    vec3 origin = to_cells(params.grid, frame.eye_ws.xyz);
    vec3 direction = normalize(position_from_depth(pixel, 1.0) - frame.eye_ws.xyz);
    direction = mix(direction, vec3(1e-20), equal(direction, vec3(0.0)));
    Surface surface;
    vec4 result = vec4(0.0);
    float end = FAR;
    if (read_surface(pixel, surface)) {
        vec3 place = to_cells(params.grid, surface.position_ws), normal = surface.geometric_normal;
        end = distance(place, origin);
        ivec3 cell = clamp(ivec3(floor(shifted(place, normal, params.shift))), ivec3(0),
            params.grid.size.xyz - 1);
        Leaf leaf = leaf_at(cell);
        vec3 color = GREY;
        if (leaf.level >= params.from)
            color = draw_surface(float(leaf.level), place, leaf.edge, normal,
                pixel_on(normal, direction, end));
        result = vec4(color, float(leaf.level + 1u));
    }
    vec3 across;
    float cut = cut_at(origin, direction, across);
    vec3 place = origin + cut * direction;
    ivec3 cell = ivec3(floor(place));
    if (cut > 0.0 && cut < end && is_inside(params.grid, cell)) {
        Leaf leaf = leaf_at(cell);
        vec3 color = draw_surface(float(leaf.level), place, leaf.edge, across,
            pixel_on(across, direction, cut));
        if (leaf.level >= params.from)
            result = vec4(mix(result.rgb, color, CUT), float(leaf.level + 1u));
    }
    imageStore(seen, pixel, result);
}
