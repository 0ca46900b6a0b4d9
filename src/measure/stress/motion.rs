//! What moves from frame to frame: flicker and jumps beyond the reference's own change, and how far
//! a frame with a history is from one without.

use glam::{Quat, Vec3};

use super::scenes::{camera, closed_room, extent_m, lamp};
use super::trial::SETTLE_FRAMES;
use super::{Change, Figure, OWN, StressCase, StressError, Trial};
use crate::frame::Renderer;
use crate::image::{Aov, Image};
use crate::measure::over_time::SQUARE_PX;
use crate::metrics::MetricError;
use crate::metrics::stability::{excess_flicker, lag, popping, squares};
use crate::scene::bundled::mesh::Mesh;
use crate::scene::{Camera, Keyframe, Light, Pose, Scene};

pub(super) const FIGURES: &[Figure] = &[
    Figure {
        name: "flicker",
        pass: 0.02,
        warn: 0.05,
    },
    Figure {
        name: "popping",
        pass: 0.05,
        warn: 0.15,
    },
    Figure {
        name: "lag",
        pass: 0.02,
        warn: 0.1,
    },
];

pub(super) static CAMERA_PAN: StressCase = StressCase {
    name: "camera_pan",
    help: "the camera turns to and fro, 60 frames",
    source: "Hong 2015, section 4.3: trailing and jitter of what is kept from frame to frame",
    severity: "degrees per frame",
    severities: &[0.0625, 0.25, 1.0],
    measure: |trial, degrees| {
        let scene = trial.base()?;
        let turned = |at: f32| Scene {
            camera: scene.camera.turned(at),
            ..scene.clone()
        };
        figures(trial, |frame| {
            turned(to_and_fro(frame, degrees as f32, 10.0))
        })
    },
    any_scene: true,
    ..MOTION
};

pub(super) static CAMERA_DOLLY: StressCase = StressCase {
    name: "camera_dolly",
    help: "the camera moves ahead and back, 60 frames; grids that follow it must not show this",
    source: "Hong 2015, sections 2.3.3 and 2.5.2.7: cascades flicker unless they snap; Panteleev \
             2014: clipmaps",
    measure: |trial, voxels| {
        let scene = trial.base()?;
        let Camera { eye, target, .. } = scene.camera;
        let moved = |at_m: f32| Scene {
            camera: Camera {
                eye: eye + at_m * (target - eye).normalize(),
                ..scene.camera
            },
            ..scene.clone()
        };
        let cell_m = extent_m(&scene) * trial.cell_share();
        figures(trial, |frame| {
            moved(to_and_fro(
                frame,
                voxels as f32 * cell_m,
                0.15 * extent_m(&scene),
            ))
        })
    },
    any_scene: true,
    ..MOTION
};

pub(super) static MOVING_LIGHT: StressCase = StressCase {
    name: "moving_light",
    help: "the first light moves to and fro, 60 frames (a directional light turns)",
    source: "Villegas & Ramírez, section VI-C: voxels are lit by a shadow map; Dachsbacher & \
             Stamminger 2005: texels that jump",
    measure: |trial, voxels| {
        let scene = trial.base()?;
        let cell_m = extent_m(&scene) * trial.cell_share();
        let way_m = 0.15 * extent_m(&scene);
        figures(trial, |frame| {
            moved_light(&scene, to_and_fro(frame, voxels as f32 * cell_m, way_m))
        })
    },
    any_scene: true,
    ..MOTION
};

pub(super) static LEVEL_JUMPS: StressCase = StressCase {
    name: "level_jumps",
    help: "a small block moves in a corner, 60 frames, and the opposite wall is looked at: levels \
           that are chosen by what is near jump there, where the light hardly changes",
    source: "Olovsson 2012, section 6.1: temporal intensity jumps",
    figures: &[Figure {
        name: "popping",
        pass: 0.02,
        warn: 0.06,
    }],
    measure: |trial, voxels| {
        let scene = block_in_corner();
        let speed_m = voxels as f32 * trial.cell_m();
        let all = figures(trial, |frame| {
            let mut moved = scene.clone();
            moved.set_time(to_and_fro(frame, speed_m, 1.0));
            moved
        })?;
        Ok(vec![all[1]])
    },
    changes: VOXELIZED,
    ..MOTION
};

/// What a moving model costs less by.
const VOXELIZED: &[Change] = &[Change {
    name: "voxelize_every",
    values: &["2", "4", "8"],
    needs: None,
}];

pub(super) static MOVING_OBJECT: StressCase = StressCase {
    name: "moving_object",
    help: "a block moves to and fro through a room, 60 frames; its surface jumps from voxel to \
           voxel",
    source: "Crassin et al. 2011: dynamic objects are voxelized anew in each frame",
    measure: |trial, voxels| {
        let scene = block_in_room();
        let speed_m = voxels as f32 * trial.cell_m();
        figures(trial, |frame| {
            let mut moved = scene.clone();
            moved.set_time(to_and_fro(frame, speed_m, 1.0));
            moved
        })
    },
    changes: VOXELIZED,
    ..MOTION
};

const MOTION: StressCase = StressCase {
    severity: "voxels per frame",
    severities: &[0.0625, 0.25, 1.0],
    quick: &[0.25],
    figures: FIGURES,
    ..OWN
};

/// The scene with its first light moved along x (m), or turned as if it were one extent away.
pub(super) fn moved_light(scene: &Scene, at_m: f32) -> Scene {
    let mut moved = scene.clone();
    match moved.lights.first_mut() {
        Some(Light::Point { position, .. } | Light::Spot { position, .. }) => position.x += at_m,
        Some(Light::Directional { direction, .. }) => {
            *direction = Quat::from_rotation_z(at_m / extent_m(scene)) * *direction
        }
        None => {}
    }
    moved
}

/// How far something is in a frame that moves so far from each to the next, and turns back at the
/// end of its way.
pub(super) fn to_and_fro(frame: usize, speed: f32, way: f32) -> f32 {
    let along = (frame as f32 * speed) % (2.0 * way);
    along.min(2.0 * way - along)
}

/// A room with a lamp, and a red block that is 1 m further along x at 1 s.
pub(super) fn block_in_room() -> Scene {
    let mut scene = closed_room().0.into_scene(
        "block-in-room",
        lamp([0.3, 2.6, 0.4], 8.0),
        Vec3::ZERO,
        camera([0.0, 1.6, 1.9], [0.0, 0.7, -1.0], 65.0),
    );
    let mut block = Mesh::default();
    let red = block.matte("block", [0.8, 0.2, 0.15]);
    block.cuboid(
        [red; 6],
        Vec3::new(-1.0, 0.02, -0.9),
        Vec3::new(-0.1, 1.1, 0.0),
    );
    block.add_moving(&mut scene, "block", pushed(Vec3::X));
    scene
}

/// A room with a lamp, seen towards one wall, and behind the camera a small block that is 1 m
/// further along x at 1 s.
fn block_in_corner() -> Scene {
    let mut scene = closed_room().0.into_scene(
        "block-in-corner",
        lamp([0.3, 2.6, 0.4], 8.0),
        Vec3::ZERO,
        camera([0.0, 1.6, 0.6], [0.0, 1.3, -2.0], 60.0),
    );
    let mut block = Mesh::default();
    let red = block.matte("block", [0.8, 0.2, 0.15]);
    block.cuboid(
        [red; 6],
        Vec3::new(-0.7, 0.4, 1.5),
        Vec3::new(-0.4, 0.7, 1.8),
    );
    block.add_moving(&mut scene, "block", pushed(Vec3::X));
    scene
}

/// Keyframes of what moves by this in a second (m).
pub(super) fn pushed(way_m: Vec3) -> Vec<Keyframe> {
    [0.0, 1.0]
        .map(|time_s| Keyframe {
            time_s,
            pose: Pose {
                translate: way_m * time_s,
                ..Pose::default()
            },
        })
        .into()
}

/// Frames of a technique that keeps what it has from one to the next, against the reference of
/// each.
pub(super) fn figures(
    trial: &Trial<'_>,
    scene_at: impl Fn(usize) -> Scene,
) -> Result<Vec<f64>, StressError> {
    let first = scene_at(0);
    let (mut renderer, _) =
        Renderer::new(trial.gpu, &first, trial.entry, trial.settings, trial.frame)?;
    (1..trial.frames_to_rest()).try_for_each(|_| renderer.render(&first.camera).map(drop))?;
    let (mut frames, mut references) = (Vec::new(), Vec::new());
    for frame in 0..trial.effort.frames {
        let scene = scene_at(frame);
        renderer.move_lights(&scene)?;
        if scene.moves() {
            renderer.set_pose(&scene)?;
        }
        renderer.render(&scene.camera)?;
        frames.push(renderer.aov(Aov::Indirect)?);
        references.push(trial.frame_reference(&scene)?);
    }
    let last = scene_at(trial.effort.frames - 1);
    let settled = trial.frames_to_rest().max(SETTLE_FRAMES);
    (0..settled).try_for_each(|_| renderer.render(&last.camera).map(drop))?;
    Ok(judge(&frames, &references, &renderer.aov(Aov::Indirect)?)?)
}

/// Flicker, popping and lag of a sequence, by means of squares.
fn judge(
    frames: &[Image],
    references: &[Image],
    converged: &Image,
) -> Result<Vec<f64>, MetricError> {
    let coarse = |images: &[Image]| {
        images
            .iter()
            .map(|image| squares(image, SQUARE_PX))
            .collect::<Vec<Image>>()
    };
    let (shown, truth) = (coarse(frames), coarse(references));
    let last = frames
        .last()
        .ok_or(MetricError::Empty("a sequence needs at least two images"))?;
    Ok(vec![
        excess_flicker(&shown, &truth)?,
        popping(&shown, &truth)?,
        lag(last, converged)?,
    ])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sequence(value: impl Fn(usize) -> f32) -> Vec<Image> {
        (0..8)
            .map(|frame| Image::from_fn(8, 8, |_| Vec3::splat(value(frame))))
            .collect()
    }

    #[test]
    fn ways_turn_back() {
        let ways: Vec<f32> = (0..6).map(|frame| to_and_fro(frame, 0.5, 1.0)).collect();
        assert_eq!(ways, [0.0, 0.5, 1.0, 0.5, 0.0, 0.5]);
    }

    /// Planted: light that changes as the reference's is no flicker, however wrong it is; flicker,
    /// one jump, swapped frames and a late last frame are each seen.
    #[test]
    fn planted_failures_are_seen() -> Result<(), MetricError> {
        let reference = sequence(|frame| 1.0 + frame as f32);
        let mean = 4.5;
        let of = |frames: &[Image]| judge(frames, &reference, &frames[7]);
        let wrong = of(&sequence(|frame| 3.0 + frame as f32))?;
        assert!(wrong.iter().all(|figure| *figure < 1e-6), "{wrong:?}");
        let flickering = of(&sequence(|frame| {
            1.0 + frame as f32 + 0.1 * (frame % 2) as f32
        }))?;
        assert!(
            (flickering[0] - 0.1 / mean).abs() < 1e-6 && (flickering[1] - 0.1 / mean).abs() < 1e-6,
            "{flickering:?}"
        );
        let jump = of(&sequence(|frame| {
            1.0 + frame as f32 + if frame >= 4 { 0.7 } else { 0.0 }
        }))?;
        assert!(
            (jump[1] - 0.7 / mean).abs() < 1e-6 && (jump[0] - 0.1 / mean).abs() < 1e-6,
            "{jump:?}"
        );
        let mut swapped = reference.clone();
        swapped.swap(2, 5);
        assert!(of(&swapped)?[1] > 0.5);
        let late = judge(&reference, &reference, &sequence(|_| 10.0)[0])?;
        assert!(
            late[..2] == [0.0; 2] && (late[2] - 0.2).abs() < 1e-6,
            "{late:?}"
        );
        assert!(judge(&reference[..7], &reference, &reference[6]).is_err());
        Ok(())
    }

    /// The block moves, and stays in the room.
    #[test]
    fn the_block_moves() {
        let mut scene = block_in_room();
        let before = scene.vertices.clone();
        scene.set_time(1.0);
        assert!(scene.moves() && before != scene.vertices && (extent_m(&scene) - 4.0).abs() < 1e-6);
        assert!(
            scene
                .triangles
                .is_sorted_by_key(|triangle| triangle.material)
        );
    }
}
