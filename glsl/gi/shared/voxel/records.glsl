// Fragments (one triangle in one voxel) and voxels (all fragments of one voxel), as stored.
#ifndef LUMIVOX_RECORDS
#define LUMIVOX_RECORDS

#include "shared/packing.glsl"

// bits            0        16       32
// place_area.x    | x      | y      |  voxel coordinates
//            y    | z      | area   |  area of the triangle inside the voxel, AREA_UNIT = one face
// normal_albedo.x | octahedral, 2×16 |
//               y | 10 | 10 | 10 |     square roots of the linear albedo
// position_next.x | 10 | 10 | 10 |     mean of the triangle's part inside, from the voxel's
//                                      smallest corner
//               y | index + 1 of the voxel's next fragment, 0 at the end |
// In pairs, since devices load and store two words at once.
struct Fragment {
    uvec2 place_area;
    uvec2 normal_albedo;
    uvec2 position_next;
};

// As Fragment, summed over the voxel's fragments and divided once by the total area. The mean
// normal is not of unit length. area (16 bits) is a half float [voxel faces]; the largest sum of
// area · |normal| over the three axes is the coverage.
struct Voxel {
    uint xy;
    uint z_area;
    uint normal;              // 3×10 bits, (n + 1) / 2; of opposed parallel planes, theirs
    uint albedo;
    uint mean_position;       // area-weighted centroid, as in Fragment
    // | coverage 12 | seen from one side 9 | seen from both sides 8 | opposed 1 | axis 2 |
    uint coverage;
    uint across;              // 3×10 bits: area seen from one side along x, y, z [voxel faces]
};
// coverage: fraction of the face seen along the dominant axis, unorm. Seen, unorm: share of the
// voxel's surface that is seen from outside, from one side of it or from both; from one side 1 for
// a sheet or a corner, ½ for a thin wall whose two faces lie in one voxel. Such surfaces are
// opposed, along `axis` most of all. Of other surfaces `axis` is 1 where they are concave.

const float AREA_UNIT = 16384.0;

vec3 voxel_coordinates(uint xy, uint z_area) {
    return vec3(xy & 0xffffu, xy >> 16, z_area & 0xffffu);
}

// Area of a fragment, in AREA_UNIT.
uint area_of(Fragment fragment) { return fragment.place_area.y >> 16; }

vec3 unpack_mean_normal(uint packed) {
    return unpack_unorm10(packed) * 2.0 - 1.0;
}

float unpack_coverage(uint packed) {
    return float(packed & 0xfffu) / 4095.0;
}

// x: seen from one side, y: from both.
vec2 unpack_seen(uint packed) {
    return vec2(float(packed >> 12 & 0x1ffu) / 511.0, float(packed >> 21 & 0xffu) / 255.0);
}

bool is_opposed(Voxel voxel) {
    return (voxel.coverage >> 29 & 1u) != 0u;
}

// Whether surfaces of several planes meet like the walls of a room, not like those of a box.
bool is_concave(Voxel voxel) {
    return !is_opposed(voxel) && voxel.coverage >> 30 == 1u;
}

// Of a mean normal: whether all of a voxel's surface lies in parallel planes.
bool is_one_plane(vec3 mean_normal) {
    return dot(mean_normal, mean_normal) >= 0.9;
}

// The direction that parts the two sides of a voxel's surface: its mean normal, or the axis along
// which surfaces are opposed that are not parallel.
vec3 front_of(Voxel voxel) {
    vec3 n = unpack_mean_normal(voxel.normal);
    if (is_opposed(voxel) && !is_one_plane(n))
        return vec3(equal(uvec3(voxel.coverage >> 30), uvec3(0u, 1u, 2u)));
    return normalize(n);
}

// Whether a ray that hits the voxel sees its back. A corner has several planes that are not
// opposed: there the ray sees the front if it meets the front of any of them.
bool sees_back(Voxel voxel, vec3 direction) {
    vec3 n = unpack_mean_normal(voxel.normal);
    if (is_opposed(voxel) || is_one_plane(n)) return dot(direction, front_of(voxel)) > 0.0;
    return all(greaterThan(direction * n, vec3(-0.05)));
}

// What rays read of a voxel:
// bits 0               30             32
// x    | mean position | axis         |
// y    | mean normal   | opposed | 0  |
// z    | across        | 0            |
uvec3 pack_surface(Voxel voxel) {
    uint axis = voxel.coverage >> 30, opposed = voxel.coverage >> 29 & 1u;
    return uvec3(
        voxel.mean_position | axis << 30, voxel.normal | opposed << 30, voxel.across);
}

// As much of a voxel's record.
Voxel unpack_surface(uvec3 surface) {
    Voxel voxel = Voxel(0u, 0u, 0u, 0u, 0u, 0u, 0u);
    voxel.mean_position = surface.x;
    voxel.normal = surface.y;
    voxel.coverage = surface.x & 0xc0000000u | (surface.y >> 30 & 1u) << 29;
    voxel.across = surface.z;
    return voxel;
}

// Of voxels with six radiances: the normal that face number `face` (+x, −x, +y, −y, +z, −z) of the
// voxel stands for. A plane has its own on the side of the face, other voxels have the face's.
vec3 normal_of_face(Voxel voxel, uint face) {
    vec3 n = unpack_mean_normal(voxel.normal), axis = vec3(0.0);
    axis[face >> 1] = (face & 1u) == 0u ? 1.0 : -1.0;
    if (!is_one_plane(n)) return axis;
    return dot(n, axis) < 0.0 ? -normalize(n) : normalize(n);
}

vec3 unpack_albedo(uint packed) {
    vec3 root = unpack_unorm10(packed);
    return root * root;
}

#endif
