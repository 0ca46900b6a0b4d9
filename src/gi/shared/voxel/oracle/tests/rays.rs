//! Rays through them.

use super::*;

/// A wall of voxels at x = 5, one in front of it at (2, 3, 3), facing −x.
fn walled() -> TraceGrid {
    let voxel = |radiance: f64| TraceVoxel {
        mean_position: DVec3::splat(0.5),
        mean_normal: DVec3::NEG_X,
        opposed_axis: None,
        is_concave: false,
        across: DVec3::X,
        radiance: [DVec3::splat(radiance); 2],
    };
    let wall = (0..64).map(|index| ([5, index / 8, index % 8], voxel(1.0)));
    TraceGrid {
        resolution: 8,
        voxels: wall.chain([([2, 3, 3], voxel(4.0))]).collect(),
    }
}

const FLOOR: Receiver = Receiver {
    position: DVec3::new(0.5, 3.5, 0.25),
    geometric_normal: DVec3::Z,
    shading_normal: DVec3::Z,
};
const ANY_TOUCH: TraceSettings = TraceSettings {
    self_height: -100.0,
    contour_slack: -1.0,
    seed: 0,
    ray: 0,
};

fn ended(origin: DVec3, direction: DVec3, settings: TraceSettings) -> (VoxelIndex, f64) {
    match trace(&walled(), origin, direction, &FLOOR, &settings) {
        TraceEnd::Hit(hit) => (hit.voxel, hit.entry),
        TraceEnd::Miss(distance) => ([u32::MAX; 3], distance),
    }
}

#[test]
fn rays_hit_the_nearest_voxel() {
    let origin = DVec3::new(0.5, 3.5, 3.5);
    assert_eq!(ended(origin, DVec3::X, ANY_TOUCH), ([2, 3, 3], 1.5));
    assert_eq!(
        ended(origin + DVec3::Z, DVec3::X, ANY_TOUCH),
        ([5, 3, 4], 4.5)
    );
    assert_eq!(ended(origin, DVec3::NEG_X, ANY_TOUCH), ([u32::MAX; 3], 0.5));
    assert_eq!(
        ended(DVec3::new(2.5, 3.5, 3.5), DVec3::X, ANY_TOUCH),
        ([2, 3, 3], 0.0)
    );
    assert_eq!(
        ended(DVec3::new(-1.0, 3.5, 3.5), DVec3::X, ANY_TOUCH),
        ([u32::MAX; 3], 0.0)
    );
}

#[test]
fn low_voxels_are_the_receiver() {
    let origin = DVec3::new(0.5, 3.5, 3.5);
    // Mean height of (2, 3, 3) over the receiver's plane is 3.25.
    assert_eq!(
        ended(
            origin,
            DVec3::X,
            TraceSettings {
                self_height: 3.25,
                ..ANY_TOUCH
            }
        )
        .0,
        [2, 3, 3]
    );
    assert_eq!(
        ended(
            origin,
            DVec3::X,
            TraceSettings {
                self_height: 3.26,
                ..ANY_TOUCH
            }
        )
        .0,
        [u32::MAX; 3]
    );
}

/// From (0.5, 3.5, 1.5) towards (2.5, 3.5, z) the plane x = 2.5 of the voxel (2, 3, 3) is met at
/// height z.
#[test]
fn contours_cut_the_corners_of_voxels() {
    let origin = DVec3::new(0.5, 3.5, 1.5);
    let towards = |z: f64| (DVec3::new(2.5, 3.5, z) - origin).normalize();
    let contour = |slack: f64| TraceSettings {
        contour_slack: slack,
        ..ANY_TOUCH
    };
    assert_eq!(ended(origin, towards(2.9), ANY_TOUCH).0, [2, 3, 3]);
    assert_eq!(ended(origin, towards(2.9), contour(0.0)).0, [5, 3, 4]);
    assert_eq!(ended(origin, towards(2.9), contour(0.2)).0, [2, 3, 3]);
    let seen = crossings(&walled(), origin, towards(2.9), &FLOOR, &contour(0.0));
    assert!(seen.first().is_some_and(|first| close(first.margin, -0.1)));
}

/// A chain that fills 3% of a voxel stops 3% of the rays; a plane with a hole, a share of them.
#[test]
fn surfaces_stop_rays_by_the_area_that_they_show() {
    let stopped = |voxel: TraceVoxel| {
        let grid = TraceGrid {
            resolution: 8,
            voxels: [([3, 3, 3], voxel)].into(),
        };
        let stops = |ray: u32| {
            let settings = TraceSettings {
                self_height: -100.0,
                contour_slack: 0.1,
                seed: 7,
                ray,
            };
            let origin = DVec3::new(0.5, 3.5, 3.5);
            matches!(
                trace(&grid, origin, DVec3::X, &FLOOR, &settings),
                TraceEnd::Hit(_)
            )
        };
        f64::from((0..1000).filter(|ray| stops(*ray)).count() as u32) / 1000.0
    };
    let chain = TraceVoxel {
        mean_position: DVec3::splat(0.5),
        mean_normal: DVec3::splat(0.1),
        opposed_axis: Some(0),
        is_concave: false,
        across: DVec3::new(0.03, 0.5, 0.5),
        radiance: [DVec3::ONE; 2],
    };
    assert!((stopped(chain) - 0.03).abs() < 0.005, "{}", stopped(chain));
    let plane = |area: f64| TraceVoxel {
        mean_normal: DVec3::NEG_X,
        opposed_axis: None,
        across: DVec3::X * area,
        ..chain
    };
    assert!((stopped(plane(0.4)) - 0.4).abs() < 0.02);
    assert_eq!(stopped(plane(0.95)), 1.0);
    assert_eq!(
        stopped(TraceVoxel {
            is_concave: true,
            mean_normal: DVec3::splat(-0.4),
            opposed_axis: None,
            ..chain
        }),
        1.0
    );
}

#[test]
fn rays_gather_a_furnace_and_the_environment() {
    let inside = |index: u32| [index % 8, index / 8 % 8, index / 64];
    let shell = (0..512)
        .map(inside)
        .filter(|voxel| voxel.iter().any(|at| *at == 0 || *at == 7));
    let voxel = TraceVoxel {
        mean_position: DVec3::splat(0.5),
        mean_normal: DVec3::ZERO,
        opposed_axis: None,
        is_concave: false,
        across: DVec3::ONE,
        radiance: [DVec3::new(1.0, 2.0, 3.0); 2],
    };
    let furnace = TraceGrid {
        resolution: 8,
        voxels: shell.map(|at| (at, voxel)).collect(),
    };
    let receiver = Receiver {
        position: DVec3::new(4.0, 4.0, 2.0),
        ..FLOOR
    };
    let settings = GatherSettings {
        ray_count: 64,
        start_offset: 0.5,
        trace: ANY_TOUCH,
        ao_falloff: 0.0,
        pattern: DVec2::new(0.5, 0.0),
        environment: DVec3::splat(0.5),
    };
    let gathered = gather_rays(&furnace, &receiver, &settings);
    assert!(near(gathered.irradiance, PI * voxel.radiance[0]) && close(gathered.visibility, 0.0));
    let open = gather_rays(
        &TraceGrid {
            resolution: 8,
            ..TraceGrid::default()
        },
        &receiver,
        &settings,
    );
    assert!(near(open.irradiance, DVec3::splat(0.5 * PI)) && close(open.visibility, 1.0));
}

#[test]
fn directions_are_cosine_distributed_unit_vectors() {
    for normal in [
        DVec3::Z,
        DVec3::NEG_Z,
        DVec3::new(0.6, 0.0, -0.8),
        DVec3::new(-2.0, 1.0, 2.0) / 3.0,
    ] {
        let [a, b] = [0.0, PI / 2.0].map(|azimuth| hemisphere_direction(normal, 0.36, azimuth));
        assert!(close(a.length(), 1.0) && close(a.dot(normal), 0.8) && close(b.dot(normal), 0.8));
        // A quarter of a turn apart: only the parts along the normal remain.
        assert!(close(a.dot(b), 0.64));
    }
}
