// voxel.inject_rsm: every texel of the reflective shadow maps adds its reflected flux to the voxels
// that its footprint lies in (Hong 2015, section 4.1, where it is the voxel of its centre: then a
// voxel four texels wide has three or five of them by chance).
//
// Φ = ρ E A for a parallel light (A: area of a texel across the beam), Φ = ρ I Ω for a perspective
// map (Ω: solid angle of the texel, Olovsson 2012, section 3.3). Sums are 40-bit integers, the same
// in every run. Per voxel, or per side: Φ / (π h²) for r, g, b [W/(m² sr)], and lit surface in
// voxel faces.
layout(local_size_x = 8, local_size_y = 8) in;

#include "shared/light_view.glsl"
#include "gi/shared/voxel/light/flux.glsl"
#include "gi/shared/voxel/grid.glsl"
#include "gi/shared/voxel/light/tiles.glsl"
#include "gi/shared/voxel/records.glsl"

// 2: the flux of each side of a voxel apart; 6: what each face of it sees of the flux
layout(constant_id = 0) const uint SIDES = 1;
// edge of the block of texels that a thread adds as one where it can [texels]
layout(constant_id = 1) const int BLOCK = 1;

layout(constant_id = 2) const bool LISTED = false;   // only texels that voxel.list_tiles has listed

const int SPLIT = 3;

// Texels that a thread looks for others like; those left after them are added one by one. Else a
// block of 8² texels that are all different would take 2,080 reads.
const int LEADERS = 8;

layout(std430, set = 1, binding = 0) restrict readonly buffer LightViews {
    LightView light_views[];
};
#include "shared/cascade.glsl"
layout(set = 1, binding = 1) uniform texture2DArray shadow_maps;
layout(set = 1, binding = 2) uniform utexture2DArray rsm_normal;
layout(set = 1, binding = 3) uniform texture2DArray rsm_reflected;
// a side of a voxel: gi/shared/voxel/light/flux.glsl
layout(std430, set = 1, binding = 4) restrict buffer Flux { uint flux[]; };
layout(std430, set = 1, binding = 5) restrict buffer LightCounters {
    uint lost_texels;
    uint filled_voxels;
};
layout(std430, set = 1, binding = 6) restrict readonly buffer Voxels { Voxel voxels[]; };
layout(std430, set = 1, binding = 7) restrict readonly buffer ListedTiles {
    uvec3 list_groups;
    uint list_count;
    uint list[];
};

layout(push_constant) uniform InjectParams {
    vec4 grid;             // xyz: smallest corner of the grid [m]; w: voxel size [m]
    // of the grid, whose voxels are added to: smallest corner and edge [voxels]
    ivec4 piece;
    // box of voxels whose light stays as it is: nothing has to be added to them
    ivec4 kept_low;
    ivec4 kept_end;
    uint resolution;
    uint first_voxel;  // of the piece's voxels; their records and sums start with it
    uint voxel_count;
    float flux_unit;   // of one integer step, for r, g, b [W/(m² sr)]
    float area_unit;   // of one integer step [voxel faces]
    uint group_row;    // groups along an edge of a map
} params;

// How far a position is outside of a box along an axis, at most [voxels]; below 0 inside.
float distance_from(vec3 position, vec3 low, vec3 end) {
    vec3 beyond = abs(position - 0.5 * (low + end)) - 0.5 * (end - low);
    return max(beyond.x, max(beyond.y, beyond.z));
}

float distance_from_piece(vec3 position) {
    return distance_from(position, vec3(params.piece.xyz), vec3(params.piece.xyz + params.piece.w));
}

// Whether light at a position can fall on voxels that are lit anew: it reaches a voxel's width
// around it.
bool may_reach(vec3 position) {
    return distance_from_piece(position) < 1.5
        && distance_from(position, vec3(params.kept_low), vec3(params.kept_end)) > -1.5;
}

void add(uint side, uint channel, float value) {
    value = min(floor(value + 0.5), LARGEST_FLUX);
    if (value <= 0.0) return;
    float high_part = floor(value * (1.0 / 4294967296.0));
    uint low = uint(value - high_part * 4294967296.0), high = uint(high_part);
    uint at = FLUX_WORDS * side + channel;
    uint before = atomicAdd(flux[at], low);
    if (before + low < before) high += 1u;
    // Only very bright voxels come here, most of them once; a full byte stays full.
    at = FLUX_WORDS * side + 4u;
    for (uint known = 0u; high != 0u;) {
        uint sum = min((known >> 8u * channel & 255u) + high, 255u);
        uint found =
            atomicCompSwap(flux[at], known, bitfieldInsert(known, sum, int(8u * channel), 8));
        if (found == known) high = 0u;
        known = found;
    }
}

// Compact index of the occupied voxel at a grid position, or −1. The including pass defines it, and
// declares what it reads from binding 8 on.
int voxel_at(vec3 position);

// Adds r, g, b and area to the lit side of a voxel, if it is one of this dispatch's.
void inject(int slot, vec3 lit_side, vec4 values) {
    uint side = uint(slot) - params.first_voxel;
    if (side >= params.voxel_count) return;
    if (SIDES == 6u) {
        vec3 along = abs(normalize(lit_side));
        for (uint axis = 0u; axis < 3u; ++axis) {
            uint face = 6u * side + 2u * axis + uint(lit_side[axis] < 0.0);
            for (uint channel = 0u; channel < 4u; ++channel)
                add(face, channel, along[axis] * values[channel]);
        }
        return;
    }
    if (SIDES == 2u) side = 2u * side + uint(dot(lit_side, front_of(voxels[side])) < 0.0);
    for (uint channel = 0u; channel < 4u; ++channel) add(side, channel, values[channel]);
}

// What texels of a map light: a parallelogram of surface.
struct Footprint {
    vec3 centre;          // [voxels]
    vec3 right, down;     // its edges [voxels]
    vec3 normal;
    vec3 ray;             // from the light, not of unit length
    vec4 values;          // r, g, b, area, in integer steps
};

// The surface may lie in the neighbour by a rounding error, or by the map's depth error at a
// grazing angle.
int nearby_voxel(Footprint footprint) {
    int slot = voxel_at(footprint.centre + 0.05 * footprint.normal);
    if (slot < 0) slot = voxel_at(footprint.centre - 0.05 * footprint.normal);
    if (slot < 0) slot = voxel_at(footprint.centre + 0.5 * normalize(footprint.ray));
    if (slot < 0) slot = voxel_at(footprint.centre - 0.5 * normalize(footprint.ray));
    return slot;
}

vec3 permute(vec3 p, uint last) { return last == 0u ? p.yzx : last == 1u ? p.zxy : p; }
vec3 unpermute(vec3 p, uint last) { return last == 0u ? p.zxy : last == 1u ? p.yzx : p; }

// Spreads a footprint over the voxels that it lies in: the voxel of its centre and, along each
// axis, the nearer neighbour. It is cut into SPLIT² parts, and each part counts as the box around
// it. What would fall on empty voxels stays in the voxel of the centre.
void spread(Footprint footprint) {
    vec3 lit_side =
        dot(footprint.normal, footprint.ray) < 0.0 ? footprint.normal : -footprint.normal;
    // The axis across the surface comes last: few footprints reach along it, and the loop below is
    // then short.
    vec3 steepness = abs(footprint.normal);
    uint last = steepness.x > steepness.y && steepness.x > steepness.z ? 0u
        : steepness.y > steepness.z                                    ? 1u
                                                                       : 2u;
    vec3 centre = permute(footprint.centre, last), right = permute(footprint.right, last),
         down = permute(footprint.down, last);
    vec3 home = floor(centre), towards = 2.0 * step(0.5, centre - home) - 1.0;
    vec3 past = abs(centre - home - 0.5) - 0.5;   // of the border to the nearer neighbour
    right *= towards;
    down *= towards;
    vec3 reach = max(0.5 * (abs(right) + abs(down)) / float(SPLIT), vec3(1e-4));
    // along the last axis; along the others: 00, 10, 01, 11
    vec4 in_home = vec4(0.0), in_next = vec4(0.0);
    for (int i = 0; i < SPLIT * SPLIT; ++i) {
        vec2 at = (vec2(i % SPLIT, i / SPLIT) + 0.5) / float(SPLIT) - 0.5;
        vec3 share = clamp((past + at.x * right + at.y * down + reach) / (2.0 * reach), 0.0, 1.0);
        vec4 across =
            vec4(1.0 - share.x, share.x, 1.0 - share.x, share.x) * vec4(1.0 - share.yy, share.yy);
        in_home += across * (1.0 - share.z);
        in_next += across * share.z;
    }
    float left = 1.0;
    int count = in_next == vec4(0.0) ? 4 : 8;
    for (int i = 1; i < count; ++i) {
        float weight = (i < 4 ? in_home : in_next)[i & 3] / float(SPLIT * SPLIT);
        vec3 position = unpermute(home + vec3(i & 1, i >> 1 & 1, i >> 2) * towards, last);
        int slot = weight > 0.0 ? voxel_at(position) : -1;
        if (slot < 0) continue;
        inject(slot, lit_side, footprint.values * weight);
        left -= weight;
    }
    int slot = voxel_at(footprint.centre);
    if (slot < 0) slot = nearby_voxel(footprint);
    if (slot >= 0) inject(slot, lit_side, footprint.values * left);
    else if (distance_from_piece(footprint.centre) < 0.0) atomicAdd(lost_texels, 1u);
}

// The footprint of one texel; false where the light meets nothing.
bool read_texel(ivec3 texel, LightView view, out Footprint footprint) {
    float stored = texelFetch(sampler2DArray(shadow_maps, nearest_clamp), texel, 0).r;
    float depth_m = map_depth(view, stored, view.right.w), size = float(view.light.y);
    vec2 map = (vec2(texel.xy) + 0.5) / size * 2.0 - 1.0;
    vec3 across = map.x * view.right.xyz + map.y * view.down.xyz;
    bool parallel = view.origin_kind.w == 0.0;
    vec3 ray = parallel ? view.forward.xyz : view.forward.xyz + across;
    vec3 position = view.origin_kind.xyz + (parallel ? across : vec3(0.0)) + ray * depth_m;
    vec3 normal = unpack_unit(texelFetch(usampler2DArray(rsm_normal, nearest_clamp), texel, 0).r);
    vec3 root = texelFetch(sampler2DArray(rsm_reflected, nearest_clamp), texel, 0).rgb;

    float squared = dot(ray, ray);   // 1 for a parallel light
    float texel_size = 4.0 * length(view.right.xyz) * length(view.down.xyz) / (size * size);
    // A [m²], or Ω [sr]
    float extent = parallel ? texel_size : texel_size / (squared * sqrt(squared));
    vec3 flux_w = root * root * lights[view.light.x].power_outer.rgb * extent;
    float along = dot(normal, ray), scale_m = parallel ? 1.0 : depth_m;
    float area = extent / max(abs(along) * inversesqrt(squared), 0.02) * scale_m * scale_m
        * (parallel ? 1.0 : squared);
    along = along < 0.0 ? min(along, -1e-3) : max(along, 1e-3);
    vec3 right = view.right.xyz - ray * (dot(normal, view.right.xyz) / along),
         down = view.down.xyz - ray * (dot(normal, view.down.xyz) / along);

    float voxel_size = params.grid.w, face = voxel_size * voxel_size;
    vec4 values = vec4(flux_w / (PI * face * params.flux_unit), area / (face * params.area_unit));
    float edge = 2.0 * scale_m / (size * voxel_size);
    footprint = Footprint(
        (position - params.grid.xyz) / voxel_size, edge * right, edge * down, normal, ray, values);
    return stored != 0.0 && !is_in_finer_cascade(texel.z, view, texel.xy);
}

void main() {
    uvec3 block = gl_GlobalInvocationID;
    if (LISTED) {
        uint at = gl_WorkGroupID.x + GROUPS_ALONG * gl_WorkGroupID.y, row = params.group_row;
        if (at >= list_count) return;
        block =
            uvec3(list[at] % row, list[at] / row % row, list[at] / (row * row)) * gl_WorkGroupSize
            + gl_LocalInvocationID;
    }
    ivec3 first = ivec3(block) * ivec3(BLOCK, BLOCK, 1);
    LightView view = light_views[first.z];
    if (any(greaterThanEqual(first.xy, ivec2(view.light.y)))) return;
    // Texels of one plane and small together against a voxel are added as one.
    uvec2 added = uvec2(0u);
    int seed = 0, leaders = 0;
    while (seed < BLOCK * BLOCK) {
        Footprint group, texel;
        ivec2 start = ivec2(seed % BLOCK, seed / BLOCK), low = start, high = start;
        bool is_lit = read_texel(first + ivec3(start, 0), view, group);
        int next = BLOCK * BLOCK;
        for (int i = seed + 1; i < BLOCK * BLOCK; ++i) {
            if ((added[i >> 5] >> (i & 31) & 1u) != 0u) continue;
            if (leaders == LEADERS) {
                next = i;
                break;
            }
            ivec2 at = ivec2(i % BLOCK, i / BLOCK);
            bool is_texel_lit = read_texel(first + ivec3(at, 0), view, texel);
            vec3 offset = texel.centre - group.centre;
            bool is_alike = is_lit && dot(texel.normal, group.normal) > 0.999
                && abs(dot(offset, group.normal)) < 0.02;
            is_alike = is_alike && all(lessThan(abs(offset), vec3(0.5)));
            if (is_texel_lit && is_alike) {
                low = min(low, at);
                high = max(high, at);
                group.values += texel.values;
            }
            if (!is_texel_lit || is_alike) added[i >> 5] |= 1u << (i & 31);
            else if (next == BLOCK * BLOCK) next = i;
        }
        vec2 middle = 0.5 * vec2(low + high - 2 * start);
        group.centre += middle.x * group.right + middle.y * group.down;
        group.right *= float(high.x - low.x + 1);
        group.down *= float(high.y - low.y + 1);
        if (is_lit && may_reach(group.centre)) spread(group);
        leaders = min(leaders + 1, LEADERS);
        seed = next;
    }
}
