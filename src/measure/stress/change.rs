//! Light that changes from one frame to the next, by itself or since something moves out of its
//! way: how late it is shown.

use glam::Vec3;

use super::motion::{moved_light, pushed};
use super::scenes::extent_m;
use super::{Change, Figure, OWN, StressCase, StressError, Trial};
use crate::frame::Renderer;
use crate::image::{Aov, Image};
use crate::measure::draw::Ticks;
use crate::metrics::MetricError;
use crate::metrics::stability::shown_change;
use crate::scene::bundled::mesh::Mesh;
use crate::scene::{Light, Scene};

/// Frames after the change that are told, in the order of [`FIGURES`].
const TOLD: [usize; 3] = [1, 2, 8];

/// Share of the change that is not shown, or shown too much.
const FIGURES: &[Figure] = &[
    Figure {
        name: "unshown_1",
        pass: 0.2,
        warn: 0.5,
    },
    Figure {
        name: "unshown_2",
        pass: 0.1,
        warn: 0.5,
    },
    Figure {
        name: "unshown_8",
        pass: 0.02,
        warn: 0.1,
    },
];

/// What keeps light of frames before.
pub(super) const HISTORY: &[Change] = &[
    Change {
        name: "history",
        values: &["0", "8", "32"],
        needs: None,
    },
    Change {
        name: "relight_tile",
        values: &["0"],
        needs: None,
    },
    Change {
        name: "relight_slack",
        values: &["0.1"],
        needs: None,
    },
    Change {
        name: "blur",
        values: &["off", "adaptive"],
        needs: None,
    },
];

pub(super) static LIGHT_SWITCH: StressCase = StressCase {
    name: "light_switch",
    help: "the first light is dimmed or switched off in one frame; light of frames before stays",
    source: "Schied et al. 2018: lag of temporal filters; Hong 2015, section 4.3",
    severity: "light that is left [share]",
    ticks: Ticks::Linear,
    severities: &[0.75, 0.25, 0.0],
    quick: &[0.25],
    measure: |trial, left| {
        let before = trial.base()?;
        let mut after = before.clone();
        if let Some(light) = after.lights.first_mut() {
            dim(light, left as f32);
        }
        unshown(trial, [&before, &after])
    },
    ..CHANGE
};

pub(super) static LIGHT_JUMP: StressCase = StressCase {
    name: "light_jump",
    help: "the first light is elsewhere from one frame to the next (a directional light turns)",
    source: "Schied et al. 2018: lag of temporal filters; Hong 2015, section 4.3",
    severity: "way of the light [scene extents]",
    severities: &[0.0625, 0.125, 0.25],
    quick: &[0.125],
    measure: |trial, extents| {
        let before = trial.base()?;
        let after = moved_light(&before, extents as f32 * extent_m(&before));
        unshown(trial, [&before, &after])
    },
    ..CHANGE
};

/// As many frames after a door has opened are looked at.
const WAITED: usize = 32;

pub(super) static DOOR_OPENS: StressCase = StressCase {
    name: "door_opens",
    help: "a door between a lit and a dark room slides open in one frame; the figures are the \
           frames until the dark room shows 90 and 99% of the change, 33 where 32 are too few",
    source: "Majercik et al. 2019: probes keep light of frames before; Hong 2015, section 4.3",
    severity: "width that opens [share]",
    ticks: Ticks::Linear,
    severities: &[0.25, 0.5, 1.0],
    quick: &[1.0],
    figures: &[
        Figure {
            name: "frames_90",
            pass: 2.0,
            warn: 16.0,
        },
        Figure {
            name: "frames_99",
            pass: 8.0,
            warn: 32.0,
        },
    ],
    changes: HISTORY,
    measure: |trial, open| {
        let closed = rooms_with_a_door(open as f32)?;
        let mut opened = closed.clone();
        opened.set_time(1.0);
        let shown = shown_after(trial, [&closed, &opened], WAITED)?;
        Ok([0.9, 0.99].map(|share| frames_until(&shown, share)).into())
    },
    ..OWN
};

/// Two rooms, and before the opening of their wall a door of its width, which slides by this share
/// of it in a second.
fn rooms_with_a_door(open: f32) -> Result<Scene, StressError> {
    let mut scene = Scene::bundled("two-rooms", &[("door".to_owned(), 1.0)])?;
    let mut door = Mesh::default();
    let paint = door.matte("door", [0.6, 0.6, 0.6]);
    door.cuboid(
        [paint; 6],
        Vec3::new(-0.15, 0.001, -0.55),
        Vec3::new(-0.051, 2.05, 0.55),
    );
    door.add_moving(&mut scene, "door", pushed(Vec3::Z * (1.1 * open)));
    Ok(scene)
}

/// The first frame from which on this share of a change is shown, counted from 1; one more than
/// there are where none is.
fn frames_until(shown: &[f64], share: f64) -> f64 {
    let is_shown = |shown: &f64| (1.0 - shown).abs() <= 1.0 - share;
    let late = shown.iter().rposition(|shown| !is_shown(shown));
    let late = late.map_or(0, |last| last + 1);
    (late + 1) as f64
}

const CHANGE: StressCase = StressCase {
    figures: FIGURES,
    any_scene: true,
    changes: HISTORY,
    ..OWN
};

fn dim(light: &mut Light, left: f32) {
    match light {
        Light::Directional {
            irradiance: power, ..
        }
        | Light::Point {
            intensity: power, ..
        }
        | Light::Spot {
            intensity: power, ..
        } => *power *= left,
    }
}

/// Share of a change of light that is not shown in some frames after it.
fn unshown(trial: &Trial<'_>, scenes: [&Scene; 2]) -> Result<Vec<f64>, StressError> {
    let shown = shown_after(trial, scenes, TOLD[TOLD.len() - 1])?;
    Ok(TOLD.map(|frame| (1.0 - shown[frame - 1]).abs()).into())
}

/// Share of a change that each of so many frames after it shows.
fn shown_after(
    trial: &Trial<'_>,
    [before, after]: [&Scene; 2],
    frames: usize,
) -> Result<Vec<f64>, StressError> {
    let camera = before.camera;
    let settled = trial.frames_to_settle();
    let start = |scene: &Scene| -> Result<(Renderer<'_>, Image), StressError> {
        let (mut renderer, _) =
            Renderer::new(trial.gpu, scene, trial.entry, trial.settings, trial.frame)?;
        (0..settled).try_for_each(|_| renderer.render_again(&camera).map(drop))?;
        let picture = renderer.aov(Aov::Indirect)?;
        Ok((renderer, picture))
    };
    let (_, new) = start(after)?;
    let (mut renderer, old) = start(before)?;
    renderer.move_lights(after)?;
    if after.moves() {
        renderer.set_pose(after)?;
    }
    let mut shown = Vec::new();
    for _ in 0..frames {
        renderer.render(&camera)?;
        shown.push(
            match shown_change(&renderer.aov(Aov::Indirect)?, [&old, &new]) {
                // Nothing changes, so nothing is late.
                Err(MetricError::Empty(_)) => 1.0,
                shown => shown?,
            },
        );
    }
    Ok(shown)
}
