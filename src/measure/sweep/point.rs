//! One measured point of a sweep, as its record keeps it.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use serde::{Deserialize, Serialize};

use super::front::Price;
use crate::graph::{Gpu, PassTimes, Spread};
use crate::measure::bench::{BenchSettings, Case};
use crate::measure::figures::structure_bytes;
use crate::measure::report::{ErrorReport, MemoryRow, Report, Timing};
use crate::measure::table::{median_ms, value_text};
use crate::metrics::{BLOCK_PX, Channel, Errors};
use crate::reference::Bounces;
use crate::scene::{Fnv, Scene};

/// Version of the record's form; a change of meaning raises it.
pub const RECORD_VERSION: u32 = 1;

/// What all points of one chart have alike: points of different setups cannot be compared.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Setup {
    /// Hash of the scene's content, in hexadecimal digits.
    pub scene_hash: String,
    /// Width and height (px).
    pub size: [u32; 2],
    /// Width and height of each shadow map (texels).
    pub shadow_resolution: u32,
    /// Frames that were measured.
    pub frames: u32,
    /// Builds that were measured.
    pub rebuilds: u32,
    /// Largest standard error of 8×8-pixel means at which the reference was done, relative to the mean.
    pub max_error: f64,
    /// What of a colour is compared.
    pub channel: Channel,
    /// Where times are from.
    pub timing: Timing,
    /// Device.
    pub device: String,
    /// Driver and its version.
    pub driver: String,
    /// Version of the program.
    pub version: String,
    /// The commit that the program was built from; where that is not known, `executable` and the hash of its file.
    pub build: String,
}

/// Error of one set of values.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PointError {
    /// √mean (T − R)² / mean R.
    pub rel_rmse: f64,
    /// mean (T − R) / mean R.
    pub bias: f64,
}

/// One technique with all its settings, measured.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Point {
    /// [`RECORD_VERSION`].
    pub record_version: u32,
    /// Hash of setup, technique and settings, in hexadecimal digits.
    pub key: String,
    /// Name of the scene.
    pub scene: String,
    /// What the points of a chart have alike.
    pub setup: Setup,
    /// Technique.
    pub technique: String,
    /// The preset that the settings started from.
    pub preset: Option<String>,
    /// The settings that differ from the preset's, `resolution` left out.
    pub changes: BTreeMap<String, String>,
    /// All settings.
    pub settings: BTreeMap<String, String>,
    /// Indirect bounces, of the reference too.
    pub bounces: Bounces,
    /// Why there is no error or nothing at all: what the device refused, or what could not be compared.
    pub failure: Option<String>,
    /// Of a failure for want of space: what was too large, and its bytes.
    pub refused: Option<MemoryRow>,
    /// As in a report: `build`, `update`, `gather`, `indirect`, `shared`, `frame`.
    pub totals: Vec<PassTimes>,
    /// Each pass of a build.
    pub build: Vec<PassTimes>,
    /// Each pass of a frame.
    pub passes: Vec<PassTimes>,
    /// All bytes on the device, the scene and what all techniques share among them.
    pub memory_bytes: u64,
    /// Bytes of what the technique keeps in the world.
    pub structure_bytes: Option<u64>,
    /// Counts, by name.
    pub counts: BTreeMap<String, u64>,
    /// Error of the indirect light over blocks; over pixels where the picture has no blocks. `None` where there is no light to be relative to.
    pub error: Option<PointError>,
    /// The same over pixels.
    pub pixel_error: Option<PointError>,
    /// Mean ꟻLIP of the indirect light.
    pub flip: Option<f64>,
    /// The error on each material, most pixels first.
    pub materials: Vec<(String, PointError)>,
    /// Standard error of the reference in the measure of `error`: no difference below it means anything.
    pub noise: Option<f64>,
}

/// What an error is weighed against.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cost {
    /// Time of indirect light in a frame (ms): geometry stands still, light and camera move.
    Frame,
    /// The same with the structure built anew (ms): everything moves.
    Rebuild,
    /// Bytes of the technique's structure.
    Memory,
}

impl Cost {
    /// All of them.
    pub const ALL: [Cost; 3] = [Cost::Frame, Cost::Rebuild, Cost::Memory];
}

impl Setup {
    /// Of a scene on a device; `max_error` is the reference's.
    pub fn new(gpu: &Gpu, scene: &Scene, settings: &BenchSettings, max_error: f64) -> Self {
        let info = gpu.info();
        Setup {
            scene_hash: format!("{:032x}", scene.content_hash()),
            size: settings.frame.size,
            shadow_resolution: settings.frame.shadow_resolution,
            frames: settings.frames,
            rebuilds: settings.rebuilds,
            max_error,
            channel: settings.channel,
            timing: settings.timing,
            device: info.name.clone(),
            driver: info.driver.clone(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            build: build(),
        }
    }

    /// The key of a case: a hash of all that its result depends on.
    pub fn key(&self, case: &Case) -> String {
        let settings: Vec<String> = case.settings.iter().map(|(name, value)| format!("{name}={}", value_text(&value))).collect();
        self.hash(&format!("{} {settings:?}", case.entry.name))
    }

    /// The key of the reference of so many bounces.
    pub fn reference_key(&self, bounces: Bounces) -> String {
        format!("reference-{}", self.hash(&format!("{bounces:?}")))
    }

    fn hash(&self, what: &str) -> String {
        let mut hash = Fnv::default();
        // Writing to a hash cannot fail.
        let _ = write!(hash, "{RECORD_VERSION} {self:?} {what}");
        format!("{:032x}", hash.value())
    }
}

/// What the program was built from, as far as it can be told.
fn build() -> String {
    let of_executable = || {
        let mut hash = Fnv::default();
        let bytes = std::env::current_exe().and_then(std::fs::read);
        bytes.iter().for_each(|bytes| hash.bytes(bytes));
        format!("executable {:032x}", hash.value())
    };
    option_env!("LUMIVOX_COMMIT").map_or_else(of_executable, str::to_owned)
}

impl PointError {
    /// `None` where it is not a number: nothing was to be seen in the reference.
    fn of(errors: &Errors) -> Option<Self> {
        let Errors { rel_rmse, bias, .. } = *errors;
        (rel_rmse.is_finite() && bias.is_finite()).then_some(PointError { rel_rmse, bias })
    }
}

/// The bounces that a case computes.
pub fn bounces_of(case: &Case) -> Bounces {
    (case.entry.bounces)(&case.settings).map_or(Bounces::Full, Bounces::Count)
}

impl Point {
    /// What a report says of a case.
    pub fn new(setup: &Setup, case: &Case, report: &Report) -> Self {
        let of_preset = case.entry.settings::<&str>(case.preset.as_deref(), &[]).ok();
        let preset_value = |name: &str| of_preset.iter().flat_map(|settings| settings.iter()).find(|(key, _)| *key == name).map(|(_, value)| value);
        let is_changed = |(name, value): &(&str, _)| *name != "resolution" && preset_value(name) != Some(*value);
        let text = |(name, value): (&str, _)| (name.to_owned(), value_text(&value));
        let error = report.error.as_ref();
        let (in_blocks, noise_share) = match error.map(|error| error.block) {
            Some(Some(block)) => (Some(block), 1.0 / f64::from(BLOCK_PX)),
            _ => (error.map(|error| error.pixel), 1.0),
        };
        let point_error = in_blocks.as_ref().and_then(PointError::of);
        let is_dark = error.is_some() && point_error.is_none();
        let dark = || "the reference shows no indirect light, to which an error could be relative".to_owned();
        Point {
            record_version: RECORD_VERSION,
            key: setup.key(case),
            scene: report.scene.clone(),
            setup: setup.clone(),
            technique: case.entry.name.to_owned(),
            preset: case.preset.clone(),
            changes: case.settings.iter().filter(is_changed).map(text).collect(),
            settings: case.settings.iter().map(text).collect(),
            bounces: bounces_of(case),
            failure: report.failure.clone().or_else(|| is_dark.then(dark)),
            refused: report.refused.clone(),
            totals: report.totals.clone(),
            build: report.build.clone(),
            passes: report.passes.clone(),
            memory_bytes: report.memory_bytes,
            structure_bytes: structure_bytes(report),
            counts: report.counts.iter().map(|(name, count)| ((*name).to_owned(), *count)).collect(),
            error: point_error,
            pixel_error: error.and_then(|error| PointError::of(&error.pixel)),
            flip: error.map(|error| f64::from(error.flip.mean)).filter(|flip| flip.is_finite()),
            materials: error.map(material_errors).unwrap_or_default(),
            noise: report.reference.map(|reference| reference.pixel_noise * noise_share).filter(|noise| noise.is_finite()),
        }
    }

    /// One of the totals (ms).
    pub fn total(&self, name: &str) -> Option<Spread> {
        self.totals.iter().find(|total| total.name == name).map(|total| total.gpu_ms)
    }

    /// The median of one of the totals (ms).
    pub fn median_ms(&self, name: &str) -> Option<f64> {
        median_ms(&self.totals, name)
    }

    /// What it costs; `None` where it was not measured or nothing is spent.
    pub fn cost(&self, cost: Cost) -> Option<Spread> {
        let spread = match cost {
            Cost::Frame => self.total("indirect")?,
            Cost::Rebuild => add(self.total("indirect")?, self.total("build")?),
            Cost::Memory => {
                let bytes = self.structure_bytes? as f64;
                Spread { median: bytes, min: bytes, max: bytes, n: 1 }
            }
        };
        (spread.median > 0.0).then_some(spread)
    }

    /// Its place on a chart; `None` where it has none.
    pub fn price(&self, cost: Cost) -> Option<Price> {
        Some(Price { cost: self.cost(cost)?, error: self.error?.rel_rmse })
    }

    /// `resolution`, where the technique has it.
    pub fn resolution(&self) -> Option<&str> {
        self.settings.get("resolution").map(String::as_str)
    }

    /// Technique, preset and resolution.
    pub fn name(&self) -> String {
        let resolution = self.resolution().map(|resolution| format!("{resolution}³"));
        [Some(self.technique.clone()), self.preset.clone(), resolution].into_iter().flatten().collect::<Vec<_>>().join(" ")
    }

    /// What differs from the preset, as it would be written on the command line.
    pub fn changes_text(&self) -> String {
        self.changes.iter().map(|(name, value)| format!("{name}={value}")).collect::<Vec<_>>().join(" ")
    }

    /// The material with the largest error.
    pub fn worst_material(&self) -> Option<&(String, PointError)> {
        self.materials.iter().max_by(|a, b| a.1.rel_rmse.total_cmp(&b.1.rel_rmse))
    }
}

/// Spread of a sum of two that were not measured together: the extremes are added.
fn add(a: Spread, b: Spread) -> Spread {
    Spread { median: a.median + b.median, min: a.min + b.min, max: a.max + b.max, n: a.n.min(b.n) }
}

/// By blocks; a material that has none is too small to be judged.
fn material_errors(error: &ErrorReport) -> Vec<(String, PointError)> {
    error.materials.iter().filter_map(|errors| Some((errors.material.clone(), PointError::of(errors.block.as_ref()?)?))).collect()
}

/// "1 bounce", "2 bounces", "all bounces".
pub fn bounces_text(bounces: Bounces) -> String {
    match bounces {
        Bounces::Count(1) => "1 bounce".into(),
        Bounces::Count(count) => format!("{count} bounces"),
        Bounces::Full => "all bounces".into(),
    }
}
