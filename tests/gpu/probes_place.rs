//! Where probes stand.

use glam::Vec3;
use lumivox::gi::probes::Lattice;
use lumivox::gi::probes::explore::explore;
use lumivox::gi::probes::relocate::away;
use lumivox::gi::probes::snap::snap;
use lumivox::render::GpuScene;
use lumivox::render::bvh::SceneRays;

use crate::support::compare::Largest;
use crate::support::gpu;
use crate::support::scenes::bundled;

/// A lattice of 5³ probes, a metre apart, from the origin on.
fn metre_lattice() -> Lattice {
    Lattice::within((Vec3::splat(-0.5), Vec3::splat(4.5)), 5, 0.5)
}

/// Places on the plane z = `height`, seen from `side`.
fn wall(height: f32, side: f32) -> Vec<(Vec3, Vec3)> {
    let places = (0..400u16).map(|at| (f32::from(at % 20), f32::from(at / 20)));
    places
        .map(|(x, y)| (Vec3::new(0.2 * x, 0.2 * y, height), side * Vec3::Z))
        .collect()
}

#[test]
fn probes_snap_to_the_side_that_is_seen() {
    let lattice = metre_lattice();
    let moved = |seen: &[(Vec3, Vec3)], probe: u32| {
        let (before, after) = (
            lattice.place(probe),
            snap(&lattice, seen, 0.15, 0.0)[probe as usize],
        );
        assert_eq!(before.truncate(), after.truncate(), "along the wall");
        [before.z, after.z]
    };
    let middle = |z: u32| 2 + 5 * (2 + 5 * z);
    // A wall between two layers: both go to its side, the far one through it.
    let seen = wall(1.4, 1.0);
    let [[_, low], [_, high]] = [1, 2].map(|z| moved(&seen, middle(z)));
    assert!(
        (low - 1.55).abs() < 1e-5 && (high - 1.55).abs() < 1e-5,
        "{low}, {high}"
    );
    // Seen from the other side it is the same on that side.
    let [_, low] = moved(&wall(1.4, -1.0), middle(1));
    assert!((low - 1.25).abs() < 1e-5, "{low}");
    // The majority decides between two sides.
    let mut both = wall(1.4, 1.0);
    both.extend(wall(1.4, -1.0).into_iter().take(100));
    assert!((moved(&both, middle(1))[1] - 1.55).abs() < 1e-5);
    // Whoever nobody asks stays, and nobody goes further than three quarters of a cell.
    assert_eq!(moved(&seen, middle(4))[1], 4.0);
    let [before, after] = moved(&wall(0.05, 1.0), middle(1));
    assert!((before - after - 0.75).abs() < 1e-5, "{after}");
    // Who cannot get through a wall does not end in it.
    let [before, after] = moved(&wall(1.65, 1.0), middle(1));
    assert_eq!(before, after);
    // Another plane, a third of a cell off, has no say, nor has one that is turned.
    let mut near = wall(1.4, 1.0);
    let further = wall(1.05, -1.0);
    near.extend(further.iter().chain(&further));
    assert!((moved(&near, middle(2))[1] - 1.55).abs() < 1e-5);
    let mut turned = wall(1.4, 1.0);
    let tilted = |(place, _): (Vec3, Vec3)| (place, Vec3::new(0.6, 0.0, -0.8));
    turned.extend(wall(1.4, 1.0).into_iter().chain(wall(1.4, 1.0)).map(tilted));
    assert!((moved(&turned, middle(2))[1] - 1.55).abs() < 1e-5);
    // Votes go where look-ups go: half a cell off the surface that is the next layer.
    let off = snap(&lattice, &wall(1.9, 1.0), 0.15, 0.5)[middle(1) as usize];
    assert_eq!(off, lattice.place(middle(1)));
    assert_eq!(snap(&lattice, &[], 0.15, 0.0).len(), 125);
}

/// Paths from the eye come to surfaces alone, and only to sides that can be seen from the air that
/// the eye is in: in a closed box not to its outside.
#[test]
fn explored_places_are_seen_sides_of_surfaces() {
    let gpu = gpu();
    let scene = bundled("furnace");
    let on_gpu = GpuScene::new(&gpu, &scene).unwrap();
    let rays = SceneRays::new(&gpu, &on_gpu).unwrap();
    let (seen, _) = explore(&gpu, &on_gpu, &rays).unwrap();
    assert_eq!(seen.len(), 4 << 16, "nothing leaves a closed box");
    let (low, high) = on_gpu.bounds;
    let middle = 0.5 * (low + high);
    for (place, normal) in &seen {
        let to_walls = (*place - low).abs().min((*place - high).abs());
        assert!(to_walls.min_element() < 1e-4, "{place} is on no wall");
        assert!(
            normal.dot(middle - *place) > 0.0,
            "{place} is seen from outside"
        );
    }
}

/// Where paths leave the scene they end.
#[test]
fn explored_paths_end_outside() {
    let gpu = gpu();
    let scene = bundled("cornell");
    let mut open = scene.clone();
    open.triangles.truncate(8);
    let on_gpu = GpuScene::new(&gpu, &open).unwrap();
    let rays = SceneRays::new(&gpu, &on_gpu).unwrap();
    let (seen, _) = explore(&gpu, &on_gpu, &rays).unwrap();
    assert!((1..4 << 16).contains(&seen.len()), "{} places", seen.len());
    let (low, high) = on_gpu.bounds;
    for (place, normal) in &seen {
        assert!(place.cmpge(low - 1e-3).all() && place.cmple(high + 1e-3).all());
        assert!((normal.length() - 1.0).abs() < 1e-4);
    }
}

#[test]
fn a_lattice_has_its_outer_layer_inside() {
    let bounds = (Vec3::new(-1.0, 0.0, 2.0), Vec3::new(3.0, 1.0, 3.0));
    for (count, outer) in [(2, 0.5), (4, 0.25), (16, 0.05), (64, 0.25)] {
        let lattice = Lattice::within(bounds, count, outer);
        assert_eq!(lattice.counts.max_element(), count);
        let [first, last] = [0, lattice.probe_count() - 1].map(|probe| lattice.place(probe));
        let off = first - bounds.0 - outer * lattice.spacing;
        assert!(off.abs().largest() < 1e-5, "{lattice:?}");
        let off = bounds.1 - last - outer * lattice.spacing;
        assert!(off.abs().largest() < 1e-5, "{lattice:?}");
    }
    // A plane has probes on both sides, a point is no error.
    let plane = Lattice::within((Vec3::ZERO, Vec3::new(4.0, 0.0, 4.0)), 8, 0.25);
    assert!(plane.first.y < 0.0 && plane.place(plane.probe_count() - 1).y > 0.0);
    let point = Lattice::within((Vec3::ONE, Vec3::ONE), 8, 0.25);
    assert!(point.cell() > 0.0);
}

/// Between two walls at −`left` and `right` (m) along x, other ways free.
fn between_walls(left: f32, right: f32) -> Vec<(Vec3, f32)> {
    let free = [Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z].map(|way| (way, f32::INFINITY));
    let walls = [(Vec3::X, right), (Vec3::NEG_X, left)];
    walls.into_iter().chain(free).collect()
}

#[test]
fn probes_move_away_from_what_is_too_near() {
    let moved = |rays: &[(Vec3, f32)]| away(Vec3::ZERO, Vec3::ZERO, 1.0, 0.2, rays).x;
    // Far enough: it stays. Else it is as far off as it should be.
    assert_eq!(moved(&between_walls(0.3, 2.0)), 0.0);
    assert!((moved(&between_walls(0.05, 2.0)) - 0.15).abs() < 1e-6);
    assert!((moved(&between_walls(f32::INFINITY, 0.1)) + 0.1).abs() < 1e-6);
    // In a gap that is too narrow it is in the middle.
    assert!((moved(&between_walls(0.05, 0.15)) - 0.05).abs() < 1e-6);
    // It never goes further than 0.45 cells from its place on the lattice.
    let at = Vec3::X * 0.4;
    let far = away(at, Vec3::ZERO, 1.0, 0.5, &between_walls(0.1, 9.0));
    assert!((far.x - 0.45).abs() < 1e-6, "{far}");
    // Where nothing is met, and where there are no rays, it stays.
    assert_eq!(moved(&between_walls(f32::INFINITY, f32::INFINITY)), 0.0);
    assert_eq!(moved(&[]), 0.0);
}
