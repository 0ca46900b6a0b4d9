//! Which voxels a triangle touches.

use super::*;

#[test]
fn grid_position_is_rounded_in_f32() {
    let grid = Grid {
        origin: Vec3::new(-1.0, 0.5, 0.0),
        voxel_size: 0.3,
        resolution: 64,
    };
    let inverse = 1.0f32 / 0.3f32;
    assert_eq!(
        grid.position([2.0, 0.5, 0.1]),
        [3.0 * inverse, 0.0, 0.1 * inverse]
    );
}

#[test]
fn small_triangle_touches_its_own_voxel() {
    assert_eq!(
        touched_voxels([[1.2, 2.2, 3.2], [1.8, 2.3, 3.4], [1.4, 2.9, 3.6]], 4),
        [[1, 2, 3]]
    );
}

#[test]
fn plane_on_a_boundary_touches_both_layers() {
    let triangle = [[0.25, 0.25, 1.0], [0.75, 0.25, 1.0], [0.25, 0.75, 1.0]];
    assert_eq!(touched_voxels(triangle, 4), [[0, 0, 0], [0, 0, 1]]);
    let at_top = triangle.map(|[x, y, _]| [x, y, 4.0]);
    assert_eq!(touched_voxels(at_top, 4), [[0, 0, 3]]);
    let outside = triangle.map(|[x, y, _]| [x, y, 4.5]);
    assert!(touched_voxels(outside, 4).is_empty());
}

/// The plane x + y + z = 1.5 cuts the octant: the voxel at the origin and its three neighbours, but
/// none with x + y ≥ 2.
#[test]
fn diagonal_triangle_touches_four_voxels() {
    let triangle = [[1.5, 0.0, 0.0], [0.0, 1.5, 0.0], [0.0, 0.0, 1.5]];
    assert_eq!(
        touched_voxels(triangle, 2),
        [[0, 0, 0], [0, 0, 1], [0, 1, 0], [1, 0, 0]]
    );
    let separation = |voxel: VoxelIndex| {
        candidates(triangle, 2, 0.0, Surface::Conservative)
            .iter()
            .find(|candidate| candidate.voxel == voxel)
            .map(|found| found.separation)
    };
    // (1, 1, 0) is nearest to the edge's middle (¾, ¾, 0).
    assert!(separation([1, 1, 0]).is_some_and(|gap| close(gap, 0.5 / 2f64.sqrt())));
    // The corner (1, 1, 1) of the voxel at the origin is 1.5 / √3 beyond the plane; its corner (0,
    // 0, 0) as far before it.
    assert!(separation([0, 0, 0]).is_some_and(|gap| close(gap, -1.5 / 3f64.sqrt())));
}

/// The plane x + y + z = 1.5 meets the cross of only one of the four voxels: the other centres are
/// 1 / √3 away, and their crosses reach ½ / √3.
#[test]
fn a_thin_diagonal_triangle_is_in_one_voxel() {
    let triangle = [[1.5, 0.0, 0.0], [0.0, 1.5, 0.0], [0.0, 0.0, 1.5]];
    let near = candidates(triangle, 2, 0.0, Surface::Thin);
    let thin: Vec<VoxelIndex> = near
        .iter()
        .filter(|near| near.separation <= 0.0)
        .map(|near| near.voxel)
        .collect();
    assert_eq!(thin, [[0, 0, 0]]);
    let beside = near.iter().find(|near| near.voxel == [1, 0, 0]);
    assert!(beside.is_some_and(|near| close(near.separation, 0.5 / 3f64.sqrt())));
}

/// With vertices on the axes at 1 the neighbours are touched in one point.
#[test]
fn touching_in_a_point_counts() {
    let triangle = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    assert_eq!(
        touched_voxels(triangle, 2),
        [[0, 0, 0], [0, 0, 1], [0, 1, 0], [1, 0, 0]]
    );
}

#[test]
fn triangles_without_area_are_skipped() {
    assert!(touched_voxels([[0.5, 0.5, 0.5], [1.5, 1.5, 1.5], [2.5, 2.5, 2.5]], 4).is_empty());
    assert!(touched_voxels([[0.5, 0.5, 0.5]; 3], 4).is_empty());
    assert!(candidates([[0.5, 0.5, 0.5]; 3], 4, 1.0, Surface::Conservative).is_empty());
}

/// The separation of every candidate against the distance found by dense sampling of the triangle.
#[test]
fn separation_agrees_with_sampled_points() {
    let triangle = [[0.3, 0.1, 0.2], [3.7, 1.3, 0.9], [1.1, 3.2, 3.6]];
    let points: Vec<DVec3> = (0..40_000)
        .map(|sample| at_weights(doubles(triangle), sample_weights(sample)))
        .collect();
    for Candidate { voxel, separation } in candidates(triangle, 4, 1.0, Surface::Conservative) {
        let corner = corner_of(voxel);
        let inside = points
            .iter()
            .any(|point| point.cmpge(corner).all() && point.cmple(corner + 1.0).all());
        assert!(
            !inside || separation <= 0.0,
            "{voxel:?} holds a point of the triangle but has {separation}"
        );
        assert!(
            inside || separation > -0.1,
            "{voxel:?} holds no point of the triangle but has {separation}"
        );
    }
}
