//! Light that changes from one frame to the next: how late it is shown.

use super::motion::moved_light;
use super::scenes::extent_m;
use super::{Change, Figure, OWN, StressCase, StressError, Trial};
use crate::frame::Renderer;
use crate::image::{Aov, Image};
use crate::measure::draw::Ticks;
use crate::metrics::MetricError;
use crate::metrics::stability::shown_change;
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
fn unshown(trial: &Trial<'_>, [before, after]: [&Scene; 2]) -> Result<Vec<f64>, StressError> {
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
    let mut shown = Vec::new();
    for _ in 0..TOLD[TOLD.len() - 1] {
        renderer.render(&camera)?;
        shown.push(
            match shown_change(&renderer.aov(Aov::Indirect)?, [&old, &new]) {
                // Nothing changes, so nothing is late.
                Err(MetricError::Empty(_)) => 1.0,
                shown => shown?,
            },
        );
    }
    let late = TOLD.map(|frame| (1.0 - shown[frame - 1]).abs());
    Ok(late.into())
}
