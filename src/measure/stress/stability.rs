//! What ought not to matter: where the scene lies in the grid, how it is turned, and which run it
//! is.

use glam::Vec3;

use super::scenes::{anchored, bounds, extent_m, placed};
use super::{Change, Figure, OWN, StressCase, StressError, Trial};
use crate::image::Image;
use crate::metrics::stability::{rotation_spread, run_spread, translation_spread};
use crate::scene::Scene;

/// Extent of the grid that the scene lies in, over the scene's own extent: the larger it is, the
/// larger the voxels.
const SEVERITY: &str = "grid over scene (the larger, the coarser the voxels)";

pub(super) static TRANSLATION: StressCase = StressCase {
    name: "translation",
    help: "scene and camera move by one voxel in 16 steps, while the grid stays",
    source: "Kahl 2019, section 6.3.1: walls at 4.9999 and at 5.0",
    severity: SEVERITY,
    severities: &[1.5, 3.0, 6.0, 12.0],
    quick: &[1.5, 6.0],
    figures: &[Figure {
        name: "translation_spread",
        pass: 0.1,
        warn: 0.3,
    }],
    any_scene: true,
    measure: |trial, grid| {
        Ok(vec![translation_spread(&pictures(
            trial,
            grid,
            |cell_m, share| (0.0, Vec3::splat(share * cell_m)),
        )?)?])
    },
    ..OWN
};

pub(super) static ROTATION: StressCase = StressCase {
    name: "rotation",
    help: "scene, lights and camera turn by 90° about the vertical in 16 steps, while the grid \
           stays",
    source: "Villegas & Ramírez, section VI-B: attenuation by axes; Kahl 2019, section 6.3.1",
    severity: SEVERITY,
    severities: &[1.5, 3.0, 6.0, 12.0],
    quick: &[1.5, 6.0],
    figures: &[Figure {
        name: "rotation_spread",
        pass: 0.1,
        warn: 0.3,
    }],
    any_scene: true,
    measure: |trial, grid| {
        Ok(vec![rotation_spread(&pictures(
            trial,
            grid,
            |_, share| (90.0 * share, Vec3::ZERO),
        )?)?])
    },
    ..OWN
};

pub(super) static REPEAT_RUNS: StressCase = StressCase {
    name: "repeat_runs",
    help: "the same picture is made four times; sums that depend on the order of threads differ",
    source: "Hong 2015, section 2.5.3.1.3: fragments fall into a voxel in arbitrary order; \
             Crassin & Green 2012: running averages",
    severity: SEVERITY,
    severities: &[1.5, 6.0, 24.0],
    quick: &[6.0],
    figures: &[Figure {
        name: "run_spread",
        pass: 0.0,
        warn: 0.01,
    }],
    any_scene: true,
    changes: &[Change {
        name: "accumulation",
        values: &[],
        needs: None,
    }],
    measure: |trial, grid| {
        let scene = in_grid(&trial.base()?, grid);
        Ok(vec![run_spread(
            &(0..RUNS)
                .map(|_| trial.indirect(&scene))
                .collect::<Result<Vec<Image>, StressError>>()?,
        )?])
    },
    ..OWN
};

const RUNS: usize = 4;

/// The scene in a grid that is so much larger.
fn in_grid(scene: &Scene, grid: f64) -> Scene {
    let (low, high) = bounds(scene);
    anchored(
        scene.clone(),
        0.5 * (low + high),
        grid as f32 * extent_m(scene),
    )
}

/// Pictures of the scene turned (degrees) and moved (m) as `place` says of the edge of a voxel (m)
/// and the share of the way.
fn pictures(
    trial: &Trial<'_>,
    grid: f64,
    place: impl Fn(f32, f32) -> (f32, Vec3),
) -> Result<Vec<Image>, StressError> {
    let base = trial.base()?;
    let (low, high) = bounds(&base);
    let edge_m = grid as f32 * extent_m(&base);
    let picture = |step: u32| {
        let (turn_deg, offset) = place(
            edge_m * trial.cell_share(),
            step as f32 / trial.effort.steps as f32,
        );
        trial.indirect(&anchored(
            placed(&base, turn_deg, 1.0, offset),
            0.5 * (low + high),
            edge_m,
        ))
    };
    (0..trial.effort.steps).map(picture).collect()
}
