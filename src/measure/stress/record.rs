//! Records of failure modes: what was measured with what, and how it is judged.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use serde::{Deserialize, Serialize};

use super::{StressCase, StressError, Trial};
use crate::gi::settings::RESOLUTION;
use crate::graph::{Error, Gpu};
use crate::measure::bench::Case;
use crate::measure::build::{build, commit};
use crate::measure::records;
use crate::measure::report::{driver_of, shadow_changes, shadow_text};
use crate::measure::table::value_text;
use crate::scene::Fnv;

/// Version of the record's format and of what is measured; raised when either changes.
const RECORD_VERSION: u32 = 1;

/// How a figure is judged.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Verdict {
    /// Good enough: at most [`Figure::pass`](super::Figure::pass).
    Pass,
    /// Visible: at most [`Figure::warn`](super::Figure::warn).
    Warn,
    /// Broken: more than that, or no finite number.
    Fail,
}

/// What records of one chart have in common.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StressSetup {
    /// Version of the program.
    pub version: String,
    /// The commit that it was built from, or a hash of the executable.
    pub build: String,
    /// Name of the device.
    pub device: String,
    /// Driver and its version, that it traces rays, and that light is in RGBA16F, where so.
    pub driver: String,
    /// Width and height of a picture (px).
    pub size: [u32; 2],
    /// Width and height of each shadow map (texels).
    pub shadow_resolution: u32,
    /// Settings of shadows that are not the defaults, by name.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub shadows: BTreeMap<String, String>,
    /// `full` or `quick`.
    pub effort: String,
}

/// A figure and its verdict.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Figured {
    /// Name of the figure.
    pub name: String,
    /// Its value; `None` where it is no finite number.
    pub value: Option<f64>,
    /// How the value is judged.
    pub verdict: Verdict,
}

/// One technique with one variant of its settings in one failure mode at one severity.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Record {
    /// Version of its format.
    pub record_version: u32,
    /// Hash of all that the figures depend on, in hexadecimal digits.
    pub key: String,
    /// What it was measured with.
    pub setup: StressSetup,
    /// Name of the failure mode.
    pub case: String,
    /// Name of the scene, where it is not the suite's own.
    pub scene: Option<String>,
    /// Hash of its content, in hexadecimal digits.
    #[serde(default)]
    pub scene_hash: Option<String>,
    /// Name of the technique.
    pub technique: String,
    /// Preset that the settings started from.
    pub preset: Option<String>,
    /// The settings that the user gave in place of the preset's, `resolution` left out.
    #[serde(default)]
    pub changes: BTreeMap<String, String>,
    /// The setting that the suite changed on top, `KEY=VALUE`; empty for none.
    pub change: String,
    /// All settings and their values, as on the command line.
    pub settings: BTreeMap<String, String>,
    /// How bad it was made.
    pub severity: f64,
    /// What was measured; empty where nothing could be.
    pub figures: Vec<Figured>,
    /// Why there is no figure: what the device refused, or what is not a number.
    pub failure: Option<String>,
    /// Whether the device stopped answering, so that it has to be opened anew.
    pub is_lost: bool,
}

impl records::Versioned for Record {
    const COMMAND: &'static str = "lumivox stress";
    const VERSION: u32 = RECORD_VERSION;

    fn version(&self) -> u32 {
        self.record_version
    }
}

impl records::Keyed for Record {
    fn key(&self) -> &str {
        &self.key
    }
}

impl StressSetup {
    /// Whether figures of the two can stand in one table: everything except the build is the same.
    pub fn is_like(&self, other: &StressSetup) -> bool {
        let rest = |setup: &StressSetup| {
            (
                setup.device.clone(),
                setup.driver.clone(),
                setup.size,
                (setup.shadow_resolution, setup.shadows.clone()),
                setup.effort.clone(),
            )
        };
        rest(self) == rest(other)
    }

    /// Setups that are alike, in a line below a title.
    pub(super) fn text<'s>(setups: impl IntoIterator<Item = &'s StressSetup>) -> String {
        let setups: Vec<&StressSetup> = setups.into_iter().collect();
        let Some(StressSetup {
            device,
            size: [width, height],
            shadow_resolution,
            shadows,
            effort,
            ..
        }) = setups.first()
        else {
            return String::new();
        };
        let mut builds: Vec<String> = setups
            .iter()
            .map(|setup| format!("{}{}", setup.version, commit(&setup.build)))
            .collect();
        builds.sort();
        builds.dedup();
        format!(
            "{device}; lumivox {}; {width}×{height} px, maps of {shadow_resolution}² texels{}, \
             {effort} effort",
            builds.join(" and "),
            shadow_text(shadows)
        )
    }

    fn new(gpu: &Gpu, trial: &Trial<'_>) -> Self {
        let info = gpu.info();
        StressSetup {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            build: build(),
            device: info.name.clone(),
            driver: driver_of(gpu),
            size: trial.frame.size,
            shadow_resolution: trial.frame.shadows.resolution,
            shadows: shadow_changes(&trial.frame.shadows),
            effort: trial.effort.name.to_owned(),
        }
    }
}

impl Record {
    pub(super) fn new(
        stress: &StressCase,
        trial: &Trial<'_>,
        case: &Case,
        change: &str,
        severity: f64,
        measured: Result<&[f64], &StressError>,
    ) -> Self {
        let setup = StressSetup::new(trial.gpu, trial);
        let judged = |(figure, value): (&super::Figure, &f64)| Figured {
            name: figure.name.to_owned(),
            value: value.is_finite().then_some(*value),
            verdict: figure.verdict(*value),
        };
        let figures: Vec<Figured> = measured
            .map(|values| stress.figures.iter().zip(values).map(judged).collect())
            .unwrap_or_default();
        let failure = measured.err();
        let infinite = || {
            figures
                .iter()
                .find(|figure| figure.value.is_none())
                .map(|figure| format!("{} is no finite number", figure.name))
        };
        Record {
            record_version: RECORD_VERSION,
            key: key(stress, trial, (case, change), severity, &setup),
            setup,
            case: stress.name.to_owned(),
            scene: trial.scene.map(|scene| scene.name.clone()),
            scene_hash: trial
                .scene
                .map(|scene| format!("{:032x}", scene.content_hash())),
            technique: trial.entry.name.to_owned(),
            preset: case.preset.clone(),
            changes: case.changes(),
            change: change.to_owned(),
            settings: trial
                .settings
                .iter()
                .map(|(name, value)| (name.to_owned(), value_text(&value)))
                .collect(),
            severity,
            failure: failure.map(ToString::to_string).or_else(infinite),
            is_lost: matches!(failure, Some(StressError::Gpu(Error::DeviceLost { .. }))),
            figures,
        }
    }

    /// The key of a record that may be there already.
    pub fn key_of(
        stress: &StressCase,
        trial: &Trial<'_>,
        case: &Case,
        change: &str,
        severity: f64,
    ) -> String {
        key(
            stress,
            trial,
            (case, change),
            severity,
            &StressSetup::new(trial.gpu, trial),
        )
    }

    /// Technique, preset, resolution and what the user changed.
    pub fn case_name(&self) -> String {
        let resolution = self
            .settings
            .get(RESOLUTION)
            .map(|resolution| format!("{resolution}³"));
        let changes = self
            .changes
            .iter()
            .map(|(name, value)| format!("{name}={value}"));
        [
            Some(self.technique.clone()),
            self.preset.clone(),
            resolution,
        ]
        .into_iter()
        .flatten()
        .chain(changes)
        .collect::<Vec<_>>()
        .join(" ")
    }

    /// Whether it is of the same technique, preset and settings in the same case, scene and
    /// severity.
    pub fn is_same_row(&self, other: &Record) -> bool {
        let of = |record: &Record| {
            (
                record.case.clone(),
                record.scene_hash.clone(),
                record.name(),
                record.severity.to_bits(),
            )
        };
        of(self) == of(other)
    }

    /// The same, and the suite's change.
    pub(super) fn name(&self) -> String {
        if self.change.is_empty() {
            self.case_name()
        } else {
            format!("{}, `{}`", self.case_name(), self.change)
        }
    }

    /// The worst verdict of all figures; `None` where there is none.
    pub fn verdict(&self) -> Option<Verdict> {
        self.figures.iter().map(|figure| figure.verdict).max()
    }
}

/// Settings alone do not tell two rows apart: one preset with a change may be another one.
fn key(
    stress: &StressCase,
    trial: &Trial<'_>,
    (case, change): (&Case, &str),
    severity: f64,
    setup: &StressSetup,
) -> String {
    let settings: Vec<String> = trial
        .settings
        .iter()
        .map(|(name, value)| format!("{name}={}", value_text(&value)))
        .collect();
    let scene = trial.scene.map(crate::scene::Scene::content_hash);
    let mut hash = Fnv::default();
    // Writing to a hash cannot fail.
    let _ = write!(
        hash,
        "{RECORD_VERSION} {setup:?} {} {severity:?} {} {:?} {change} {settings:?} {scene:?}",
        stress.name, trial.entry.name, case.preset
    );
    format!("{:032x}", hash.value())
}

impl Verdict {
    /// As it is written in tables.
    pub fn word(self) -> &'static str {
        match self {
            Verdict::Pass => "pass",
            Verdict::Warn => "warn",
            Verdict::Fail => "fail",
        }
    }
}
