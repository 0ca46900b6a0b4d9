//! Surfaces that come out from behind bars, and bars of a pixel, while the camera moves.

use glam::Vec3;

use super::change::HISTORY;
use super::motion::to_and_fro;
use super::scenes::{camera, closed_room};
use super::{ERROR, Figure, OWN, StressCase, StressError, Trial};
use crate::frame::Renderer;
use crate::gi::Settings;
use crate::image::{Aov, GuideImage, Image, luminance};
use crate::metrics::{MetricError, errors_of_values};
use crate::reference::guide;
use crate::scene::bundled::mesh::Mesh;
use crate::scene::{Camera, Light, Scene};

pub(super) static GHOST: StressCase = StressCase {
    name: "ghost",
    help: "the camera moves past a fence: light of the bars stays on the wall that comes out from \
           behind them, and the other way round",
    source: "Schied et al. 2017: disocclusion; Hong 2015, section 4.3",
    severity: "way of the fence [px per frame]",
    severities: &[0.5, 2.0, 4.0],
    quick: &[2.0],
    figures: &[Figure {
        name: "ghost",
        pass: 0.1,
        warn: 0.3,
    }],
    changes: HISTORY,
    measure: ghost,
    ..OWN
};

pub(super) static THIN_BARS: StressCase = StressCase {
    name: "thin_bars",
    help: "the camera moves past bars of a few pixels: they are new in nearly each frame, and have \
           few neighbours on one surface",
    source: "Hong 2015, section 4.2: a discontinuity buffer; Schied et al. 2017",
    severity: "width of a bar [px]",
    severities: &[8.0, 4.0, 2.0, 1.0],
    quick: &[8.0, 1.0],
    figures: ERROR,
    changes: HISTORY,
    measure: |trial, width| Ok(vec![thin_bars(trial, width as f32)?]),
    ..OWN
};

/// Where the middle of the fence is (m).
const FENCE_Z_M: f32 = -1.5;
/// Where the camera is (m).
const EYE_Z_M: f32 = 1.2;
const VFOV_DEG: f32 = 60.0;
/// How far the camera moves to each side (m).
const REACH_M: f32 = 0.4;
/// Name of the material of bars.
const BARS: &str = "bars";

/// A closed room with a fence in front of a wall. A spot light shines on the opposite wall, so that
/// the wall behind the fence has less of its light than the fence.
fn fence(width_m: f32, step_m: f32) -> Scene {
    let (mut mesh, _) = closed_room();
    let bars = mesh.matte(BARS, [0.7, 0.7, 0.7]);
    let half_m: f32 = 0.05;
    let count = (3.9 / step_m) as i32;
    for index in 0..count {
        let x = step_m * (index as f32 - 0.5 * (count - 1) as f32);
        add_bar(&mut mesh, bars, x, width_m, half_m.min(0.5 * width_m));
    }
    let spot = Light::Spot {
        position: Vec3::new(0.2, 1.5, 0.4),
        direction: Vec3::Z,
        intensity: Vec3::splat(20.0),
        inner_deg: 40.0,
        outer_deg: 50.0,
    };
    let seen = camera([-REACH_M, 1.4, EYE_Z_M], [-REACH_M, 1.4, -2.0], VFOV_DEG);
    mesh.into_scene("fence", vec![spot], Vec3::ZERO, seen)
}

/// A bar from the floor to the ceiling.
fn add_bar(mesh: &mut Mesh, material: u32, x: f32, width_m: f32, half_m: f32) {
    mesh.cuboid(
        [material; 6],
        Vec3::new(x - 0.5 * width_m, 0.0, FENCE_Z_M - half_m),
        Vec3::new(x + 0.5 * width_m, 3.0, FENCE_Z_M + half_m),
    );
}

/// Width of a pixel at the fence (m).
fn pixel_m(trial: &Trial<'_>) -> f32 {
    let tan = (0.5 * VFOV_DEG.to_radians()).tan();
    (EYE_Z_M - FENCE_Z_M) * 2.0 * tan / trial.frame.size[1] as f32
}

/// The camera of a frame, moved to the side.
fn camera_at(first: &Camera, frame: usize, step_m: f32) -> Camera {
    let aside = Vec3::X * to_and_fro(frame, step_m, 2.0 * REACH_M);
    Camera {
        eye: first.eye + aside,
        target: first.target + aside,
        ..*first
    }
}

/// What a moving camera sees, and the light that the technique has there.
struct Moving<'g> {
    renderer: Renderer<'g>,
    scene: Scene,
    step_m: f32,
}

impl<'g> Moving<'g> {
    /// At rest before the first frame.
    fn new(trial: &Trial<'g>, scene: Scene, step_m: f32) -> Result<Self, StressError> {
        let (mut renderer, _) =
            Renderer::new(trial.gpu, &scene, trial.entry, trial.settings, trial.frame)?;
        let settled = trial.frames_to_settle();
        (0..settled).try_for_each(|_| renderer.render_again(&scene.camera).map(drop))?;
        Ok(Moving {
            renderer,
            scene,
            step_m,
        })
    }

    fn camera(&self, frame: usize) -> Camera {
        camera_at(&self.scene.camera, frame, self.step_m)
    }

    fn draw(&mut self, frame: usize) -> Result<Image, StressError> {
        self.renderer.render_again(&self.camera(frame))?;
        Ok(self.renderer.aov(Aov::Diffuse)?)
    }

    /// The mean over many frames that stand still, where history has nothing of frames before.
    fn draw_at_rest(&mut self, frame: usize, frames: u32) -> Result<Image, StressError> {
        self.renderer.cut();
        let camera = self.camera(frame);
        (0..frames).try_for_each(|_| self.renderer.render_again(&camera).map(drop))?;
        Ok(self.renderer.aov(Aov::Diffuse)?)
    }

    fn guide(&self, frame: usize, [width, height]: [u32; 2]) -> Result<GuideImage, StressError> {
        let scene = Scene {
            camera: self.camera(frame),
            ..self.scene.clone()
        };
        Ok(guide(&scene, width, height)?)
    }
}

/// Directions of a pixel, where it has a number of them: the first that it may have. With 16 the
/// figure is mostly noise.
const DIRECTIONS: [u32; 3] = [64, 32, 16];

/// Every so many frames are looked at.
const STRIDE: usize = 4;

/// Of some frames, pixels that a bilinear sample of the frame before would mix with another
/// surface. Over the sample's pixels on that surface, with weight b and light W, that changes their
/// own converged light C by M = Σ b (W − C). The figure is how much of it is in their light T: Σ (T
/// − C) M / Σ M², 1 and more where samples are not tested. Noise of T does not move it.
fn ghost(trial: &Trial<'_>, speed_px: f64) -> Result<Vec<f64>, StressError> {
    if trial.entry.screen(trial.settings).longest_history == 0 {
        return Ok(vec![0.0]);
    }
    let settings = settings_of_ghosts(trial)?;
    let trial = Trial {
        settings: &settings,
        ..*trial
    };
    let scene = fence(0.3, 0.6);
    let step_m = speed_px as f32 * pixel_m(&trial);
    let mut moving = Moving::new(&trial, scene.clone(), step_m)?;
    let mut resting = Moving::new(&trial, scene, step_m)?;
    let mut before = moving.draw(0)?;
    let (mut mixed, mut whole) = (0.0, 0.0);
    for frame in 1..trial.effort.frames {
        let now = moving.draw(frame)?;
        if frame % STRIDE == 1 {
            let own = resting.draw_at_rest(frame, trial.frames_to_settle())?;
            let guides = [
                moving.guide(frame - 1, trial.frame.size)?,
                moving.guide(frame, trial.frame.size)?,
            ];
            let seen_before = moving.camera(frame - 1);
            for (at, taps) in mixed_pixels(&guides, &seen_before) {
                let light = |image: &Image, at: usize| f64::from(luminance(image.pixels[at]));
                let own = light(&own, at);
                let change = |(tap, weight): &Tap| weight * (light(&before, *tap) - own);
                let mix: f64 = taps.iter().map(change).sum();
                mixed += (light(&now, at) - own) * mix;
                whole += mix * mix;
            }
        }
        before = now;
    }
    if whole == 0.0 {
        return Err(MetricError::Empty("no surface comes out from behind another").into());
    }
    Ok(vec![(mixed / whole).abs()])
}

/// The settings without the blur, since one that is wider where there is no history is another
/// error, and with more directions, where a technique has so many: less noise, the same history.
fn settings_of_ghosts(trial: &Trial<'_>) -> Result<Settings, StressError> {
    let plain = trial.settings_with(&["blur=off"])?;
    let Some(name) = (trial.entry.directions_setting)(&plain) else {
        return Ok(plain);
    };
    let trial = Trial {
        settings: &plain,
        ..*trial
    };
    let has_fewer = |count: &u32| plain.find_count(name).is_some_and(|own| own < *count);
    let mut many = (DIRECTIONS.into_iter().filter(has_fewer))
        .filter_map(|count| trial.settings_with(&[&format!("{name}={count}")]).ok());
    Ok(many.next().unwrap_or_else(|| plain.clone()))
}

/// A pixel of a bilinear sample, and its weight in it.
type Tap = (usize, f64);

/// Pixels whose surface lies, in the frame before, between pixels of which some show another
/// material; with those.
fn mixed_pixels([before, now]: &[GuideImage; 2], camera: &Camera) -> Vec<(usize, Vec<Tap>)> {
    let [right, up, forward] = camera.basis();
    let tan = (0.5 * camera.vfov_deg.to_radians()).tan();
    let (width, height) = (now.width as f32, now.height as f32);
    let others = |at: usize| {
        let away = now.position[at] - camera.eye;
        let scale = 0.5 * height / (tan * away.dot(forward));
        let x = 0.5 * width + scale * away.dot(right) - 0.5;
        let y = 0.5 * height - scale * away.dot(up) - 0.5;
        let taps = [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)]
            .map(|(right, down)| (x.floor() + right, y.floor() + down));
        let inside = taps
            .into_iter()
            .filter(|(x, y)| (0.0..width).contains(x) && (0.0..height).contains(y));
        let weighed = inside.map(|(column, row)| {
            let weight = (1.0 - (x - column).abs()) * (1.0 - (y - row).abs());
            let index = (row as u32 * now.width + column as u32) as usize;
            (index, f64::from(weight))
        });
        weighed
            .filter(|(tap, _)| before.is_surface(*tap))
            .filter(|(tap, _)| before.material[*tap] != now.material[at])
            .collect::<Vec<Tap>>()
    };
    (0..now.material.len())
        .filter(|at| now.is_surface(*at))
        .map(|at| (at, others(at)))
        .filter(|(_, others)| !others.is_empty())
        .collect()
}

/// Frames of which bars are looked at, the last of a sequence.
const LAST_FRAMES: usize = 4;

/// Error by pixel of the irradiance on bars, against the technique's own mean of many frames.
fn thin_bars(trial: &Trial<'_>, width_px: f32) -> Result<f64, StressError> {
    let pixel_m = pixel_m(trial);
    // Less than a pixel, so that bars meet pixels in every way.
    let (scene, step_m) = (fence(width_px * pixel_m, 16.0 * pixel_m), 0.7 * pixel_m);
    let bars = scene
        .materials
        .iter()
        .position(|material| material.name == BARS);
    let means = trial.settings_with(&["history=64", "blur=off"])?;
    let mean_of = Trial {
        settings: &means,
        ..*trial
    };
    let mut moving = Moving::new(trial, scene.clone(), step_m)?;
    let mut resting = Moving::new(&mean_of, scene, step_m)?;
    let (mut shown, mut own) = (Vec::new(), Vec::new());
    for frame in 0..trial.effort.frames {
        let now = moving.draw(frame)?;
        if frame + LAST_FRAMES < trial.effort.frames {
            continue;
        }
        let converged = resting.draw_at_rest(frame, mean_of.frames_to_settle())?;
        let guide = moving.guide(frame, trial.frame.size)?;
        let on_bars = |at: &usize| bars.is_some_and(|bars| guide.material[*at] == bars as u32);
        for at in (0..guide.material.len()).filter(on_bars) {
            shown.push(luminance(now.pixels[at]));
            own.push(luminance(converged.pixels[at]));
        }
    }
    errors_of_values(&shown, &own)
        .map(|errors| errors.rel_rmse)
        .ok_or_else(|| MetricError::Empty("no pixel sees a bar").into())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::stress::scenes::extent_m;
    use crate::reference::ReferenceError;

    const SIZE: [u32; 2] = [64, 48];

    #[test]
    fn the_fence_fits_into_the_room() {
        for width_m in [0.02, 0.3] {
            let scene = fence(width_m, 0.6);
            assert!((extent_m(&scene) - 4.0).abs() < 1e-5);
        }
    }

    /// Those beside the bars are, with the bar or with the wall.
    #[test]
    fn pixels_beside_bars_are_mixed() -> Result<(), ReferenceError> {
        let scene = fence(0.3, 0.6);
        let of = |frame: usize| {
            let seen = Scene {
                camera: camera_at(&scene.camera, frame, 0.1),
                ..scene.clone()
            };
            guide(&seen, SIZE[0], SIZE[1])
        };
        let guides = [of(0)?, of(1)?];
        let mixed = mixed_pixels(&guides, &scene.camera);
        let share = mixed.len() as f32 / (SIZE[0] * SIZE[1]) as f32;
        assert!(share > 0.02 && share < 0.4, "{share}");
        for (at, others) in &mixed {
            let own = guides[1].material[*at];
            let differ = |(other, _): &Tap| guides[0].material[*other] != own;
            let weight: f64 = others.iter().map(|other| other.1).sum();
            assert!(others.iter().all(differ) && weight < 1.0 + 1e-5, "{at}");
        }
        Ok(())
    }
}
