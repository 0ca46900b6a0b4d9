//! What ought not to matter: where the scene lies in the grid, how it is turned, and which run it
//! is.

use glam::Vec3;

use super::scenes::{anchored, bounds, extent_m, placed};
use super::{Change, Figure, OWN, StressCase, StressError, Ticks, Trial};
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

pub(super) static FLIPPED_NORMALS: StressCase = StressCase {
    name: "flipped_normals",
    help: "surfaces face the other way: triangles and their normals are turned round, and all \
           surfaces have two sides; the picture has to stay",
    source: "Majercik et al. 2021: probes that see the backs of surfaces are taken for dead",
    severity: "surfaces that face the other way [share]",
    ticks: Ticks::Linear,
    severities: &[0.25, 0.5, 1.0],
    quick: &[0.5],
    figures: &[Figure {
        name: "flip_spread",
        pass: 0.01,
        warn: 0.1,
    }],
    any_scene: true,
    measure: |trial, share| {
        let base = trial.base()?;
        let pictures = [
            trial.indirect(&base)?,
            trial.indirect(&flipped(&base, share))?,
        ];
        Ok(vec![run_spread(&pictures)?])
    },
    ..OWN
};

/// The scene with so large a share of its triangles turned round, each with corners of its own.
fn flipped(scene: &Scene, share: f64) -> Scene {
    let mut scene = scene.clone();
    for (index, triangle) in (0u32..).zip(&mut scene.triangles) {
        // Spread evenly, in pairs: most rectangles are two triangles.
        let spread = f64::from((index / 2).wrapping_mul(0x9e37_79b9)) / f64::from(u32::MAX);
        if spread > share {
            continue;
        }
        triangle.vertices = triangle.vertices.map(|vertex| {
            let mut turned = scene.vertices[vertex as usize];
            turned.normal = turned.normal.map(|part| -part);
            scene.vertices.push(turned);
            scene.vertices.len() as u32 - 1
        });
        triangle.vertices.swap(1, 2);
    }
    scene
}

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

#[cfg(test)]
mod tests {
    use super::*;

    /// Triangles are where they were, and their normals point to the other side.
    #[test]
    fn flipped_triangles_face_the_other_way() -> Result<(), Box<dyn std::error::Error>> {
        let scene = Scene::bundled("cornell", &[])?;
        for share in [0.0, 0.5, 1.0] {
            let turned = flipped(&scene, share);
            let mut count = 0;
            for (before, after) in scene.triangles.iter().zip(&turned.triangles) {
                let normals = [(&scene, before), (&turned, after)].map(|(scene, triangle)| {
                    let corner = |at: usize| scene.vertices[triangle.vertices[at] as usize];
                    let [a, b, c] = [0, 1, 2].map(|at| Vec3::from(corner(at).position));
                    let middle = (a + b + c) / 3.0;
                    ((b - a).cross(c - a), Vec3::from(corner(0).normal), middle)
                });
                let [before, after] = normals;
                assert!(before.2.distance(after.2) < 1e-6);
                let sides = [before.0.dot(after.0), before.1.dot(after.1)];
                assert_eq!(sides[0] < 0.0, sides[1] < 0.0);
                count += u32::from(sides[0] < 0.0);
            }
            let found = f64::from(count) / scene.triangles.len() as f64;
            assert!((found - share).abs() < 0.15, "{found} of {share}");
        }
        Ok(())
    }
}
