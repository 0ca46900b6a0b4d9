//! Ambient visibility of what the picture does not show: occluders beyond its edge, and the backs
//! of thin ones; and rings where it should be smooth.

use glam::Vec3;

use super::scenes::add_floor;
use super::{ERROR, Figure, OWN, StressCase, StressError};
use crate::image::Image;
use crate::metrics::MetricError;
use crate::reference::ReferenceImage;
use crate::scene::bundled::mesh::Mesh;
use crate::scene::{Camera, Scene};

pub(super) static OFF_SCREEN_OCCLUDER: StressCase = StressCase {
    name: "off_screen_occluder",
    help: "the camera turns away from a wall until that is not in the picture; the figure is the \
           error of the floor's ambient visibility",
    source: "Jiménez et al. 2016; Hong 2015, figure 50",
    severity: "turn of the camera [°]",
    severities: &[0.0, 4.0, 8.0, 12.0, 16.0],
    quick: &[0.0, 12.0],
    figures: ERROR,
    measure: |trial, turn_deg| {
        Ok(vec![
            trial.visibility_error(&beside_a_wall(turn_deg as f32))?,
        ])
    },
    ..OWN
};

pub(super) static THIN_OCCLUDER: StressCase = StressCase {
    name: "thin_occluder",
    help: "a bar hangs over a floor, and light comes from under it; the largest stands on the \
           floor; the figure is the error of the ambient visibility",
    source: "Jiménez et al. 2016, section 4.2: the picture does not show how thick things are",
    severity: "height of the bar [m]",
    severities: &[1.2, 0.6, 0.3, 0.1, 0.03],
    quick: &[1.2, 0.1],
    figures: ERROR,
    measure: |trial, height| Ok(vec![trial.visibility_error(&under_a_bar(height as f32))?]),
    ..OWN
};

pub(super) static CIRCULAR_BANDS: StressCase = StressCase {
    name: "circular_bands",
    help: "a plate hangs over a floor: samples whose size doubles from level to level draw rings \
           around it; the figure is the RMS of what the error of a pixel's ambient visibility is \
           off the mean of its neighbours'",
    source: "Kahl 2019, section 6.3.1: non-smooth circular degradation; section 6.2.2: sizes of \
             samples are powers of two",
    severity: "height of the plate [voxels]",
    severities: &[16.0, 12.0, 8.0],
    quick: &[16.0, 8.0],
    figures: &[Figure {
        name: "ripple",
        pass: 0.005,
        warn: 0.02,
    }],
    measure: |trial, height| {
        let scene = under_a_plate(height as f32 * trial.cell_m());
        let truth = trial.still_reference(&scene, PLATE_SAMPLES)?;
        ripple(&trial.visibility(&scene)?, &truth).map(|ripple| vec![ripple])
    },
    ..OWN
};

/// A floor with a plate of 1 m over it, both seen from the side, so that nothing is in front of the
/// floor.
fn under_a_plate(height_m: f32) -> Scene {
    let (mut mesh, white) = floor();
    mesh.cuboid(
        [white; 6],
        Vec3::new(-0.5, height_m, -1.5),
        Vec3::new(0.5, height_m + 0.1, -0.5),
    );
    let seen = Camera {
        eye: Vec3::new(0.0, 1.4, 2.4),
        target: Vec3::new(0.0, 0.0, 0.6),
        up: Vec3::Y,
        vfov_deg: 50.0,
    };
    mesh.into_scene("under_a_plate", Vec::new(), Vec3::ONE, seen)
}

/// RMS over pixels of the floor of e − (e₋ + e₊)/2 with the pixels at [`APART`] to both sides,
/// along rows and columns, over the mean of V: e is the error of V. The reference's noise is taken
/// off, whose variance is V (1 − V)/n of n samples.
fn ripple(open: &Image, truth: &ReferenceImage) -> Result<f64, StressError> {
    let (width, seen) = (open.width as usize, &truth.guide);
    let is_floor = |at: usize| seen.is_surface(at) && seen.position[at].y < 1e-3;
    let known = |at: usize| f64::from(truth.light.visibility[at]);
    let error = |at: usize| f64::from(open.pixels[at].x) - known(at);
    let (mut sum, mut noise, mut squares) = (0.0, 0.0, 0.0);
    let (mut count, mut pairs) = (0u32, 0u32);
    for at in (0..open.pixels.len()).filter(|at| is_floor(*at)) {
        (sum, count) = (sum + known(at), count + 1);
        noise += known(at) * (1.0 - known(at)) / f64::from(truth.samples[at].max(1.0));
        for step in [APART, APART * width] {
            let is_row = step < width;
            let fits = !is_row || (APART..width - APART).contains(&(at % width));
            let (Some(before), after) = (at.checked_sub(step), at + step) else {
                continue;
            };
            if fits && after < open.pixels.len() && is_floor(before) && is_floor(after) {
                squares += (error(at) - 0.5 * (error(before) + error(after))).powi(2);
                pairs += 1;
            }
        }
    }
    if pairs == 0 || sum == 0.0 {
        return Err(MetricError::Empty("no floor is seen").into());
    }
    let count = f64::from(count);
    let own = squares / f64::from(pairs) - 1.5 * noise / count;
    Ok(own.max(0.0).sqrt() / (sum / count))
}

/// So many times the usual samples: rings are faint.
const PLATE_SAMPLES: u32 = 16;

/// Pixels between those that a line goes through.
const APART: usize = 2;

/// A floor with a wall across it, looked down at. At 0° the foot of the wall is in the picture.
fn beside_a_wall(turn_deg: f32) -> Scene {
    let (mut mesh, white) = floor();
    mesh.cuboid(
        [white; 6],
        Vec3::new(1.0, 0.0, -2.0),
        Vec3::new(1.2, 1.5, 2.0),
    );
    let eye = Vec3::new(0.0, 2.4, 0.0);
    let (sin, cos) = turn_deg.to_radians().sin_cos();
    let down = Camera {
        eye,
        target: eye + Vec3::new(-sin, -cos, 0.0),
        up: Vec3::NEG_Z,
        vfov_deg: 45.0,
    };
    mesh.into_scene("beside_a_wall", Vec::new(), Vec3::ONE, down)
}

/// A floor with a bar across it at half of 1.2 m.
fn under_a_bar(height_m: f32) -> Scene {
    let (mut mesh, white) = floor();
    let [low, high] = [-0.5, 0.5].map(|side| 0.6 + side * height_m);
    mesh.cuboid(
        [white; 6],
        Vec3::new(-1.5, low, -0.025),
        Vec3::new(1.5, high, 0.025),
    );
    let seen = Camera {
        eye: Vec3::new(0.0, 2.2, 1.9),
        target: Vec3::new(0.0, 0.3, -0.2),
        up: Vec3::Y,
        vfov_deg: 50.0,
    };
    mesh.into_scene("under_a_bar", Vec::new(), Vec3::ONE, seen)
}

fn floor() -> (Mesh, u32) {
    let mut mesh = Mesh::default();
    let white = mesh.matte("white", [0.7, 0.7, 0.7]);
    add_floor(&mut mesh, white);
    (mesh, white)
}
