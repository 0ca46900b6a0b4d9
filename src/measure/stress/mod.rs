//! Failure modes: a parameter that runs from harmless to fatal, and figures that tell how bad it
//! is, for each technique and each setting that matters.
//!
//! [`CASES`] lists them, a row each. A case makes its own scenes, or takes any.
//! [`StressCase::record`] measures one technique at one severity; [`results`] are records as tables
//! and charts.

mod change;
mod detail;
mod extent;
mod fence;
mod light;
mod motion;
mod record;
pub mod results;
mod scenes;
mod sky;
mod stability;
mod thin_walls;
mod trial;
mod visibility;

pub use record::{Figured, Record, StressSetup, Verdict};
pub use trial::{Memo, Trial};

use super::bench::Case;
use super::draw::Ticks;
use super::table::value_text;
use crate::gi::entry::Entry;
use crate::gi::settings::{Domain, SettingError};
use crate::gi::{Settings, settings::Setting};
use crate::graph::Error;
use crate::metrics::MetricError;
use crate::reference::ReferenceError;
use crate::scene::SceneError;

/// All failure modes.
pub static CASES: &[&StressCase] = &[
    &thin_walls::CASE,
    &thin_walls::WALL_SHIFT,
    &stability::TRANSLATION,
    &stability::ROTATION,
    &motion::CAMERA_PAN,
    &motion::CAMERA_DOLLY,
    &motion::MOVING_LIGHT,
    &motion::MOVING_OBJECT,
    &motion::LEVEL_JUMPS,
    &change::LIGHT_SWITCH,
    &change::LIGHT_JUMP,
    &change::DOOR_OPENS,
    &fence::GHOST,
    &fence::THIN_BARS,
    &stability::REPEAT_RUNS,
    &stability::FLIPPED_NORMALS,
    &detail::NARROW_GAP,
    &detail::DISTANT_GAP,
    &detail::SMALL_EMITTER,
    &detail::THIN_COLUMNS,
    &detail::OPPOSED_NORMALS,
    &detail::FACING_SURFACES,
    &light::GRAZING_LIGHT,
    &light::RSM_UNDERSAMPLING,
    &light::LIGHT_LEVEL,
    &light::CONTRAST,
    &light::COLOUR_BANDING,
    &light::RAY_EFFECT,
    &sky::SUN_WIDTH,
    &sky::TURN,
    &sky::HIDDEN,
    &sky::OPENING,
    &sky::SHEET,
    &sky::SUNK_BOX,
    &sky::ROUGHNESS,
    &sky::MOVED,
    &visibility::OFF_SCREEN_OCCLUDER,
    &visibility::THIN_OCCLUDER,
    &visibility::CIRCULAR_BANDS,
    &extent::SCENE_SIZE,
    &extent::TRIANGLE_COUNT,
    &extent::ONE_VOXEL,
    &extent::FAR_CAMERA,
    &extent::EMPTY,
];

/// Fewer voxels along an edge than this leave no room for the suite's scenes.
pub const LEAST_RESOLUTION: u32 = 32;

/// One failure mode.
pub struct StressCase {
    /// Name on the command line, in records and in charts.
    pub name: &'static str,
    /// What goes wrong, in one line.
    pub help: &'static str,
    /// Who names the failure.
    pub source: &'static str,
    /// What gets worse, with its unit.
    pub severity: &'static str,
    /// How charts show it.
    pub ticks: Ticks,
    /// How bad it is made, harmless first unless `severity` says what is harmless.
    pub severities: &'static [f64],
    /// The severities of a quick look.
    pub quick: &'static [f64],
    /// What is measured.
    pub figures: &'static [Figure],
    /// Whether it takes any scene, rather than having its own.
    pub any_scene: bool,
    /// Settings whose effect can be measured, where a technique has them.
    pub changes: &'static [Change],
    /// Measures the figures, in their order.
    pub measure: fn(&Trial<'_>, f64) -> Result<Vec<f64>, StressError>,
}

/// What is measured, and how it is judged; 0 is ideal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Figure {
    /// Name in records and in charts.
    pub name: &'static str,
    /// Up to this it passes.
    pub pass: f64,
    /// Up to this it is a warning; beyond it fails.
    pub warn: f64,
}

/// Error of the indirect light over blocks.
const ERROR: &[Figure] = &[Figure {
    name: "rel_rmse",
    pass: 0.2,
    warn: 0.5,
}];

/// |bias| of the indirect light: energy that is lost or made up.
const ENERGY: &[Figure] = &[Figure {
    name: "energy_error",
    pass: 0.2,
    warn: 0.5,
}];

/// What the rows of cases with a scene of their own have in common.
const OWN: StressCase = StressCase {
    name: "",
    help: "",
    source: "",
    severity: "",
    ticks: Ticks::Doubling,
    severities: &[],
    quick: &[],
    figures: ERROR,
    any_scene: false,
    changes: &[],
    measure: |_, _| Ok(Vec::new()),
};

/// A setting that matters to a failure mode.
pub struct Change {
    /// Name of the setting.
    pub name: &'static str,
    /// Values to try; none stand for all words that it takes.
    pub values: &'static [&'static str],
    /// A setting and the value that it has to have (where the technique has it) for this one to do
    /// anything.
    pub needs: Option<(&'static str, &'static str)>,
}

/// How much is measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Effort {
    /// Its name in records.
    pub name: &'static str,
    /// Steps through a voxel, or a quarter turn.
    pub steps: u32,
    /// Frames of a sequence.
    pub frames: usize,
    /// Samples per pixel of the reference of a still picture.
    pub spp: u32,
    /// Samples per pixel of the reference of a frame in a sequence.
    pub frame_spp: u32,
}

impl Effort {
    /// What figures are told with.
    pub const FULL: Effort = Effort {
        name: "full",
        steps: 16,
        frames: 60,
        spp: 256,
        frame_spp: 64,
    };
    /// A quick look: fewer severities, steps and frames.
    pub const QUICK: Effort = Effort {
        name: "quick",
        steps: 4,
        frames: 12,
        spp: 64,
        frame_spp: 16,
    };
}

/// Why there is no figure.
#[derive(Debug, thiserror::Error)]
pub enum StressError {
    /// The technique cannot be rendered.
    #[error(transparent)]
    Gpu(#[from] Error),
    /// The scene cannot be made.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// The scene cannot be traced.
    #[error(transparent)]
    Reference(#[from] ReferenceError),
    /// The technique does not take the settings.
    #[error(transparent)]
    Setting(#[from] SettingError),
    /// There is nothing to compare.
    #[error(transparent)]
    Metric(#[from] MetricError),
}

impl StressCase {
    /// How bad it is made at this effort.
    pub fn severities_at(&self, effort: &Effort) -> &'static [f64] {
        if *effort == Effort::QUICK {
            self.quick
        } else {
            self.severities
        }
    }

    /// The settings as they are, with the change that is none, and then with one change each.
    pub fn variants(
        &self,
        entry: &Entry,
        settings: &Settings,
    ) -> Result<Vec<(String, Settings)>, SettingError> {
        let is_met = |(name, wanted): &(&str, &str)| {
            settings
                .iter()
                .all(|(key, value)| key != *name || value_text(&value) == *wanted)
        };
        let mut variants = vec![(String::new(), settings.clone())];
        for change in self
            .changes
            .iter()
            .filter(|change| change.needs.as_ref().is_none_or(is_met))
        {
            let mut all = entry.all_settings();
            let Some(setting) = all.find(|setting| setting.name == change.name) else {
                continue;
            };
            for value in values(change, setting) {
                let pair = format!("{}={value}", change.name);
                let new = match changed(entry, settings, &[&pair]) {
                    // What a preset's other settings do not allow is no variant of it.
                    Err(SettingError::Together(_)) => continue,
                    new => new?,
                };
                if new != *settings {
                    variants.push((pair, new));
                }
            }
        }
        Ok(variants)
    }

    /// Measures one technique with one variant of its settings at one severity. What the device
    /// refuses and what cannot be compared is told in the record.
    pub fn record(
        &self,
        trial: &Trial<'_>,
        case: &Case,
        change: &str,
        severity: f64,
    ) -> Result<Record, StressError> {
        match (self.measure)(trial, severity) {
            Err(other @ (StressError::Scene(_) | StressError::Reference(_))) => Err(other),
            measured => Ok(Record::new(
                self,
                trial,
                case,
                change,
                severity,
                measured.as_deref(),
            )),
        }
    }
}

/// The settings with `KEY=VALUE` pairs on top.
fn changed(entry: &Entry, settings: &Settings, pairs: &[&str]) -> Result<Settings, SettingError> {
    let old = settings
        .iter()
        .map(|(name, value)| format!("{name}={}", value_text(&value)));
    let all: Vec<String> = old
        .chain(pairs.iter().map(|pair| (*pair).to_owned()))
        .collect();
    entry.settings(None, &all)
}

fn values(change: &Change, setting: &Setting) -> Vec<&'static str> {
    match setting.domain {
        Domain::Choice(words) if change.values.is_empty() => words.to_vec(),
        _ => change.values.to_vec(),
    }
}

impl Figure {
    /// How a value is judged; what is not a number fails.
    pub fn verdict(&self, value: f64) -> Verdict {
        if value <= self.pass {
            Verdict::Pass
        } else if value <= self.warn {
            Verdict::Warn
        } else {
            Verdict::Fail
        }
    }
}
