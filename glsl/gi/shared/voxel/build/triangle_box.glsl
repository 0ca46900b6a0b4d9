// Which voxels a triangle touches, and how much of it lies in each.
//
// The test is the separating axis theorem for a closed triangle and a closed unit box
// (Akenine-Möller 2001), arranged as in Schwarz & Seidel 2010, section 3: a plane test and nine
// edge tests in the three coordinate projections. Every voxelization method ends in `touches`, so
// that all methods give the same voxels bit for bit; `precise` keeps compilers from contracting one
// method's arithmetic and not another's. A thin surface (THIN) is 6-separating (Schwarz & Seidel
// 2010): of a voxel, its cross is tested, the three lines from face centre to face centre.
// Coordinates are voxels, with the axes permuted so that z is the triangle's dominant axis,
// relative to `base`.
#ifndef LUMIVOX_TRIANGLE_BOX
#define LUMIVOX_TRIANGLE_BOX

layout(constant_id = 3) const uint THIN = 0;          // 1: a voxel's cross is tested, not the voxel

struct TriangleSetup {
    uint axis;                // dominant axis: 0 x, 1 y, 2 z
    ivec3 base;               // permuted voxel coordinates of the local origin
    vec3 v0, v1, v2;          // permuted vertices relative to base
    vec3 normal;              // (v1 - v0) × (v2 - v0), permuted
    // first and last voxel of the bounding box, relative to base, cut to the grid
    ivec3 low, high;
    float plane_low, plane_high;   // interval that normal · box centre must lie in
    // each edge in each projection: axis (xy), and the interval (zw) that the box centre must lie
    // in
    vec4 xy[3], yz[3], zx[3];
    // where the tests leave anything, with a margin for rounding: along a row, x (first, last) at
    // y = 0 by each edge and its slope; along a column, z (first, last) at (0, 0) and its slopes
    vec3 rows[3];
    vec4 columns;
};

// Puts the dominant axis last, keeping the handedness: x y z → y z x, z x y or x y z.
vec3 permute(vec3 p, uint axis) { return axis == 0u ? p.yzx : axis == 1u ? p.zxy : p; }
vec3 unpermute(vec3 p, uint axis) { return axis == 0u ? p.zxy : axis == 1u ? p.yzx : p; }
ivec3 unpermute(ivec3 p, uint axis) { return axis == 0u ? p.zxy : axis == 1u ? p.yzx : p; }

// How much larger than a voxel the tested box is, relative to the coordinates: a few roundings of
// f32, so that what touches in a point or along an edge is not lost to them.
const float ROUNDING = 1.0 / 4194304.0;

// Half the extent of a voxel, or of its cross, along an axis.
float radius_along(vec3 axis, vec3 half_size) {
    vec3 along = abs(axis);
    precise float voxel = half_size.x * along.x + half_size.y * along.y + half_size.z * along.z;
    precise float cross =
        max(half_size.x * along.x, max(half_size.y * along.y, half_size.z * along.z));
    return THIN != 0u ? cross : voxel;
}

// The axis perpendicular to edge a→b in one projection, and where the centre of a touched box may
// lie along it; `c` is the opposite vertex.
vec4 edge_axis(vec2 a, vec2 b, vec2 c, vec2 half_size) {
    precise vec2 edge = b - a;
    vec2 perpendicular = vec2(-edge.y, edge.x);
    precise float on_edge = perpendicular.x * a.x + perpendicular.y * a.y;
    precise float opposite = perpendicular.x * c.x + perpendicular.y * c.y;
    float radius = radius_along(vec3(perpendicular, 0.0), vec3(half_size, 0.0));
    precise float low = min(on_edge, opposite) - radius;
    precise float high = max(on_edge, opposite) + radius;
    return vec4(perpendicular, low, high);
}

// What an edge test leaves of rows up to `most` away from 0: as in TriangleSetup.rows.
vec3 row_bounds(vec4 axis, float most) {
    if (abs(axis.x) < 1e-6) return vec3(-1e9, 1e9, 0.0);
    float inverse = 1.0 / axis.x;
    vec2 bounds = axis.zw * inverse;
    float margin = 0.01
        + 1e-5 * (abs(axis.z) + abs(axis.w) + abs(axis.y) * (most + 1.0)) * abs(inverse);
    return vec3(min(bounds.x, bounds.y) - margin, max(bounds.x, bounds.y) + margin,
        -axis.y * inverse);
}

bool inside_interval(vec4 axis, vec2 centre) {
    precise float along = axis.x * centre.x + axis.y * centre.y;
    return along >= axis.z && along <= axis.w;
}

// Which voxels of a grid are asked for.
struct Clip {
    ivec3 low, high;          // the first and the last
    int resolution;           // voxels along an edge of the grid
    // a triangle's base does not depend on where the grid is, so that neither does any rounding
    bool free_base;
};

// False where there is nothing to voxelize: no area, or outside the clip.
bool setup_triangle(vec3 a, vec3 b, vec3 c, Clip clip, out TriangleSetup s) {
    precise vec3 ab = b - a;
    precise vec3 ac = c - a;
    precise vec3 n =
        vec3(ab.y * ac.z - ab.z * ac.y, ab.z * ac.x - ab.x * ac.z, ab.x * ac.y - ab.y * ac.x);
    vec3 magnitude = abs(n);
    s.axis = magnitude.x > magnitude.y && magnitude.x > magnitude.z ? 0u
        : magnitude.y > magnitude.z                                 ? 1u
                                                                    : 2u;
    a = permute(a, s.axis);
    b = permute(b, s.axis);
    c = permute(c, s.axis);
    s.normal = permute(n, s.axis);
    vec3 low = min(a, min(b, c));
    vec3 high = max(a, max(b, c));
    ivec3 clip_low = ivec3(permute(vec3(clip.low), s.axis)),
          clip_high = ivec3(permute(vec3(clip.high), s.axis));
    if (s.normal.z == 0.0 || any(lessThan(high, vec3(clip_low)))
        || any(greaterThan(low, vec3(clip_high + 1)))) {
        return false;
    }
    vec3 origin = floor(clip.free_base ? low : clamp(low, vec3(0.0), vec3(clip.resolution)));
    s.base = ivec3(origin);
    precise vec3 v0 = a - origin, v1 = b - origin, v2 = c - origin;
    s.v0 = v0;
    s.v1 = v1;
    s.v2 = v2;
    // A closed box [i, i + 1] meets [low, high] where i ≥ ceil(low) - 1 and i ≤ floor(high).
    s.low = max(ivec3(ceil(low)) - 1, clip_low) - s.base;
    s.high = min(ivec3(floor(high)), clip_high) - s.base;
    // A needle's normal is inexact and its vertices do not lie in one plane across it: with all
    // three projected, the axis still separates nothing that touches.
    precise float along0 = s.normal.x * v0.x + s.normal.y * v0.y + s.normal.z * v0.z;
    precise float along1 = s.normal.x * v1.x + s.normal.y * v1.y + s.normal.z * v1.z;
    precise float along2 = s.normal.x * v2.x + s.normal.y * v2.y + s.normal.z * v2.z;
    precise vec3 half_size = 0.5 + ROUNDING * (max(abs(v0), max(abs(v1), abs(v2))) + 1.0);
    float radius = radius_along(s.normal, half_size);
    precise float plane_low = min(along0, min(along1, along2)) - radius,
                  plane_high = max(along0, max(along1, along2)) + radius;
    s.plane_low = plane_low;
    s.plane_high = plane_high;
    s.xy = vec4[3](edge_axis(v0.xy, v1.xy, v2.xy, half_size.xy),
        edge_axis(v1.xy, v2.xy, v0.xy, half_size.xy), edge_axis(v2.xy, v0.xy, v1.xy, half_size.xy));
    s.yz = vec4[3](edge_axis(v0.yz, v1.yz, v2.yz, half_size.yz),
        edge_axis(v1.yz, v2.yz, v0.yz, half_size.yz), edge_axis(v2.yz, v0.yz, v1.yz, half_size.yz));
    s.zx = vec4[3](edge_axis(v0.zx, v1.zx, v2.zx, half_size.zx),
        edge_axis(v1.zx, v2.zx, v0.zx, half_size.zx), edge_axis(v2.zx, v0.zx, v1.zx, half_size.zx));
    float most = float(max(abs(s.low.y), abs(s.high.y)));
    s.rows = vec3[3](
        row_bounds(s.xy[0], most), row_bounds(s.xy[1], most), row_bounds(s.xy[2], most));
    float inverse = 1.0 / s.normal.z;
    vec2 ends = vec2(plane_low, plane_high) * inverse;
    s.columns = vec4(min(ends.x, ends.y), max(ends.x, ends.y), -s.normal.xy * inverse);
    return true;
}

// The part of the test that is the same for a whole column of voxels along the dominant axis.
bool touches_column(TriangleSetup s, ivec2 column) {
    vec2 centre = vec2(column) + 0.5;
    return inside_interval(s.xy[0], centre) && inside_interval(s.xy[1], centre)
        && inside_interval(s.xy[2], centre);
}

// First and last column of a row that the edge tests can leave; `touches_column` decides.
ivec2 row_range(TriangleSetup s, int row) {
    vec2 range = vec2(s.low.x, s.high.x) + vec2(0.5);
    for (int i = 0; i < 3; ++i) {
        vec2 bounds = s.rows[i].xy + s.rows[i].z * (float(row) + 0.5);
        range = vec2(max(range.x, bounds.x), min(range.y, bounds.y));
    }
    return ivec2(ceil(range.x - 0.5), floor(range.y - 0.5));
}

// The rest of the test, for one voxel of a touched column.
bool touches(TriangleSetup s, ivec3 voxel) {
    vec3 centre = vec3(voxel) + 0.5;
    precise float along = s.normal.x * centre.x + s.normal.y * centre.y + s.normal.z * centre.z;
    return along >= s.plane_low && along <= s.plane_high && inside_interval(s.yz[0], centre.yz)
        && inside_interval(s.yz[1], centre.yz) && inside_interval(s.yz[2], centre.yz)
        && inside_interval(s.zx[0], centre.zx) && inside_interval(s.zx[1], centre.zx)
        && inside_interval(s.zx[2], centre.zx);
}

// First and last voxel of a column that the triangle's plane can reach; `touches` decides.
ivec2 depth_range(TriangleSetup s, ivec2 column) {
    vec2 ends = s.columns.xy + dot(s.columns.zw, vec2(column) + 0.5);
    // Depths of the lowest and the highest box centre, clamped to what an int can hold.
    ends = clamp(ends, vec2(s.low.z) - 4.0, vec2(s.high.z) + 4.0);
    ivec2 range = ivec2(ceil(ends.x - 0.51), floor(ends.y - 0.49));
    return clamp(range, ivec2(s.low.z, s.low.z - 1), ivec2(s.high.z + 1, s.high.z));
}

// The boundary segment that a line, n·q + c = 0 with |n| = 1 and the inside at n·q + c > 0, adds to
// a region: the points −c n + t (n.y, −n.x), t from x to y; none where x ≥ y.
struct Side {
    vec3 line;   // n, c
    vec2 t;
};

Side whole(vec3 line) { return Side(line, vec2(-4.0, 4.0)); }

// Of two values by a condition, without a branch: a driver that keeps track of every path through
// a shader has too many to keep otherwise.
float select(bool condition, float yes, float no) { return mix(no, yes, condition); }
vec2 select(bool condition, vec2 yes, vec2 no) { return mix(no, yes, bvec2(condition)); }
bool select(bool condition, bool yes, bool no) { return mix(no, yes, condition); }

// Cuts two lines' segments to each other's half-plane. If the lines coincide, `first` is kept.
void meet(inout Side first, inout Side second) {
    float sine = second.line.x * first.line.y - second.line.y * first.line.x;
    float cosine = dot(first.line.xy, second.line.xy);
    float inverse = 1.0 / sine;
    float on_first = (cosine * first.line.z - second.line.z) * inverse;
    float on_second = (first.line.z - cosine * second.line.z) * inverse;
    bool parallel = abs(sine) < 1e-6, rising = sine > 0.0;
    // Either line comes to the same decision about the other, so that the outline stays closed.
    bool outside = first.line.z + second.line.z <= 0.0;
    bool first_beaten = select(cosine > 0.0, second.line.z < first.line.z, outside);
    bool second_beaten = select(cosine > 0.0, first.line.z <= second.line.z, outside);
    vec2 cut_first = select(rising, vec2(max(first.t.x, on_first), first.t.y),
        vec2(first.t.x, min(first.t.y, on_first)));
    vec2 cut_second = select(rising, vec2(second.t.x, min(second.t.y, on_second)),
        vec2(max(second.t.x, on_second), second.t.y));
    first.t = select(parallel, vec2(first.t.x, select(first_beaten, -8.0, first.t.y)), cut_first);
    second.t =
        select(parallel, vec2(second.t.x, select(second_beaten, -8.0, second.t.y)), cut_second);
}

// `meet` of a line with two that face each other, as the two ends of a band.
void meet_band(inout Side low, inout Side high, inout Side line) {
    float sine = line.line.x * low.line.y - line.line.y * low.line.x,
          cosine = dot(low.line.xy, line.line.xy), c = line.line.z;
    float inverse = 1.0 / sine;
    float on_low = (cosine * low.line.z - c) * inverse,
          on_high = (cosine * high.line.z + c) * inverse;
    float leaves_low = (low.line.z - cosine * c) * inverse,
          leaves_high = -(high.line.z + cosine * c) * inverse;
    bool low_beaten = select(cosine > 0.0, c < low.line.z, low.line.z + c <= 0.0),
         high_beaten = select(cosine < 0.0, c < high.line.z, high.line.z + c <= 0.0);
    bool by_low = select(cosine > 0.0, low.line.z <= c, low.line.z + c <= 0.0),
         by_high = select(cosine < 0.0, high.line.z <= c, high.line.z + c <= 0.0);
    bool line_beaten = any(bvec2(by_low, by_high));
    bool parallel = abs(sine) < 1e-6, rising = sine > 0.0;
    vec2 cut_low = select(
        rising, vec2(max(low.t.x, on_low), low.t.y), vec2(low.t.x, min(low.t.y, on_low)));
    vec2 cut_high = select(
        rising, vec2(high.t.x, min(high.t.y, on_high)), vec2(max(high.t.x, on_high), high.t.y));
    vec2 cut_line = vec2(
        max(line.t.x, min(leaves_low, leaves_high)), min(line.t.y, max(leaves_low, leaves_high)));
    low.t = select(parallel, vec2(low.t.x, select(low_beaten, -8.0, low.t.y)), cut_low);
    high.t = select(parallel, vec2(high.t.x, select(high_beaten, -8.0, high.t.y)), cut_high);
    line.t = select(parallel, vec2(line.t.x, select(line_beaten, -8.0, line.t.y)), cut_line);
}

struct Outline {
    bool some;         // there is a segment
    vec2 reference;    // a corner of the region where there is one: the origin of the sums
    vec2 moment;       // times 6
    float doubled;     // area times 2
};

void add_segment(Side side, inout Outline outline) {
    vec2 p = -side.line.xy * side.line.z, d = vec2(side.line.y, -side.line.x);
    bool adds = side.t.y > side.t.x;
    outline.reference = select(adds && !outline.some, p + side.t.x * d, outline.reference);
    outline.some = outline.some || adds;
    vec2 q0 = p + side.t.x * d - outline.reference, q1 = p + side.t.y * d - outline.reference;
    float doubled = select(adds, q0.x * q1.y - q0.y * q1.x, 0.0);
    outline.moment += doubled * (q0 + q1);
    outline.doubled += doubled;
}

// Columns that are further inside than this [voxels] are cut by no edge, whatever the rounding.
const float INNER_MARGIN = 0.02;

// The line of edge a→b with the triangle's inside on its positive side.
vec3 inner_edge(vec2 a, vec2 b, float side) {
    vec2 n = side * vec2(a.y - b.y, b.x - a.x) / max(length(b - a), 1e-20);
    return vec3(n, -dot(n, a));
}

// Whether no edge cuts a column that the triangle touches.
bool is_inner(TriangleSetup s, ivec2 column) {
    float side = s.normal.z > 0.0 ? 1.0 : -1.0;
    vec3 edges[3] = vec3[3](inner_edge(s.v0.xy, s.v1.xy, side), inner_edge(s.v1.xy, s.v2.xy, side),
        inner_edge(s.v2.xy, s.v0.xy, side));
    float least = 1.0;
    for (int i = 0; i < 3; ++i) {
        vec2 n = edges[i].xy, nearest = vec2(column) + vec2(lessThan(n, vec2(0.0)));
        least = min(least, dot(n, nearest) + edges[i].z);
    }
    return least > INNER_MARGIN;
}

// Area of the triangle inside the voxel, projected along the dominant axis [voxel faces, 0 to 1],
// and the mean_position of that part relative to the voxel's smallest corner. The region is the set
// of points inside nine half-planes (three edges, four sides of the column, the voxel's floor and
// ceiling); its area and first moment are sums over the boundary segment of each (Green's theorem),
// about a corner of the region: lines that are nearly parallel, as a needle's edges are, meet at
// points that are inexact along them, which costs what the lines are away from the origin of the
// sums. In an inner column, which no edge cuts, `has_edges` may be false: the bits are the same.
float area_inside(TriangleSetup s, ivec3 voxel, bool has_edges, out vec3 mean_position) {
    vec3 corner = vec3(voxel);
    vec2 a = s.v0.xy - corner.xy, b = s.v1.xy - corner.xy, c = s.v2.xy - corner.xy;
    vec2 slope = -s.normal.xy / s.normal.z;
    float height = s.v0.z - corner.z - dot(slope, a);      // z of the plane at the column's corner
    float side = s.normal.z > 0.0 ? 1.0 : -1.0;
    // Sides of the column, cut to each other.
    Side left = Side(vec3(1.0, 0.0, 0.0), vec2(-1.0, 0.0)),
         right = Side(vec3(-1.0, 0.0, 1.0), vec2(0.0, 1.0));
    Side near = Side(vec3(0.0, 1.0, 0.0), vec2(0.0, 1.0)),
         far = Side(vec3(0.0, -1.0, 1.0), vec2(-1.0, 0.0));
    Side ab = whole(inner_edge(a, b, side)), bc = whole(inner_edge(b, c, side)),
         ca = whole(inner_edge(c, a, side));
    // A plane that is nearly level crosses the voxel's floor or ceiling nowhere in the column, or
    // everywhere: no line then.
    float steepness = length(slope);
    bool level = steepness < 1e-5;
    Side above = whole(level ? vec3(1.0, 0.0, 2.0) : vec3(slope, height) / steepness);
    Side below = whole(level ? vec3(-1.0, 0.0, 2.0) : vec3(-slope, 1.0 - height) / steepness);
    // Every pair but floor and ceiling, which never meet, spelled out: drivers keep separate
    // variables in registers, and an indexed array in memory.
    if (has_edges) {
        meet_band(left, right, ab);
        meet_band(left, right, bc);
        meet_band(left, right, ca);
    }
    meet_band(left, right, above);
    meet_band(left, right, below);
    if (has_edges) {
        meet_band(near, far, ab);
        meet_band(near, far, bc);
        meet_band(near, far, ca);
    }
    meet_band(near, far, above);
    meet_band(near, far, below);
    if (has_edges) {
        meet_band(above, below, ab);
        meet_band(above, below, bc);
        meet_band(above, below, ca);
        meet(ab, bc);
        meet(ab, ca);
        meet(bc, ca);
    }
    Outline outline = Outline(false, (a + b + c) / 3.0, vec2(0.0), 0.0);
    add_segment(left, outline);
    add_segment(right, outline);
    add_segment(near, outline);
    add_segment(far, outline);
    if (has_edges) {
        add_segment(ab, outline);
        add_segment(bc, outline);
        add_segment(ca, outline);
    }
    add_segment(above, outline);
    add_segment(below, outline);
    float area = clamp(0.5 * outline.doubled, 0.0, 1.0);
    vec2 middle = outline.reference + (area > 1e-6 ? outline.moment / (6.0 * area) : vec2(0.0));
    middle = clamp(middle, vec2(0.0), vec2(1.0));
    mean_position = clamp(vec3(middle, height + dot(slope, middle)), vec3(0.0), vec3(1.0));
    return area;
}

#endif
