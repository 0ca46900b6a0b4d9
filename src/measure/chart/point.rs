//! One measured point of a sweep, as its record keeps it.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use serde::{Deserialize, Serialize};

use super::front::Price;
use crate::gi::settings::RESOLUTION;
use crate::graph::{Gpu, PassTimes, Spread};
use crate::measure::bench::{BenchSettings, Case};
use crate::measure::build::build;
use crate::measure::records::{Keyed, Versioned};
use crate::measure::report::{ErrorReport, MemoryRow, Report, Timing, driver_of, shadow_changes};
use crate::measure::table::{median_ms, value_text};
use crate::metrics::{BLOCK_PX, Channel, Errors};
use crate::reference::{Bounces, Occlusion};
use crate::scene::{Fnv, Scene};
use crate::text::counted;

/// Version of the record's form; a change of meaning raises it.
pub const RECORD_VERSION: u32 = 1;

/// What all points of one chart have alike: points of different setups cannot be compared.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SweepSetup {
    /// Hash of the scene's content, in hexadecimal digits.
    pub scene_hash: String,
    /// Width and height (px).
    pub size: [u32; 2],
    /// Width and height of each shadow map (texels).
    pub shadow_resolution: u32,
    /// Settings of shadows that are not the defaults, by name.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub shadows: BTreeMap<String, String>,
    /// Frames that were measured.
    pub frames: u32,
    /// Builds that were measured.
    pub rebuilds: u32,
    /// Largest standard error of 8×8-pixel means at which the reference was done, relative to the
    /// mean.
    pub max_error: f64,
    /// Whether luminances are compared, or red, green and blue each.
    pub channel: Channel,
    /// The definition of the ambient visibility that is compared in place of indirect light.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub visibility: Option<Occlusion>,
    /// Where times are from.
    pub timing: Timing,
    /// Name of the device.
    pub device: String,
    /// Driver and its version, that it traces rays, and that light is in RGBA16F, where so.
    pub driver: String,
    /// Version of the program.
    pub version: String,
    /// The commit that the program was built from; where that is not known, `executable` and the
    /// hash of its file.
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
    /// The round in which it was measured, from 1; `None` in records from before there were rounds.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub round: Option<u32>,
    /// Name of the scene.
    pub scene: String,
    /// What the points of a chart have alike.
    pub setup: SweepSetup,
    /// Name of the technique.
    pub technique: String,
    /// The preset that the settings started from.
    pub preset: Option<String>,
    /// The settings that differ from the preset's, `resolution` left out.
    pub changes: BTreeMap<String, String>,
    /// All settings and their values, as on the command line.
    pub settings: BTreeMap<String, String>,
    /// Edge of the finest cells (m), where there are any.
    #[serde(default)]
    pub voxel_size_m: Option<f32>,
    /// Indirect bounces, of the reference too.
    pub bounces: Bounces,
    /// Why there is no error or nothing at all: what the device refused, or what could not be
    /// compared.
    pub failure: Option<String>,
    /// If memory did not suffice: what was too large, and its bytes.
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
    /// Error of the indirect light over blocks; over pixels where the picture has no blocks.
    /// `None` where there is no light to be relative to.
    pub error: Option<PointError>,
    /// The same over pixels.
    pub pixel_error: Option<PointError>,
    /// Mean ꟻLIP of the indirect light.
    pub flip: Option<f64>,
    /// The error on each material, most pixels first.
    pub materials: Vec<(String, PointError)>,
    /// Standard error of the reference in the measure of `error`: no difference below it means
    /// anything.
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
    /// The three costs, in the order of the charts.
    pub const ALL: [Cost; 3] = [Cost::Frame, Cost::Rebuild, Cost::Memory];
}

impl SweepSetup {
    /// The setup of a scene on a device; `max_error` is the reference's.
    pub fn new(gpu: &Gpu, scene: &Scene, settings: &BenchSettings, max_error: f64) -> Self {
        let info = gpu.info();
        SweepSetup {
            scene_hash: format!("{:032x}", scene.content_hash()),
            size: settings.frame.size,
            shadow_resolution: settings.frame.shadows.resolution,
            shadows: shadow_changes(&settings.frame.shadows),
            frames: settings.frames,
            rebuilds: settings.rebuilds,
            max_error,
            channel: settings.channel,
            visibility: settings.visibility,
            timing: settings.timing,
            device: info.name.clone(),
            driver: driver_of(gpu),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            build: build(),
        }
    }

    /// What is compared, in words.
    pub fn compared(&self) -> &'static str {
        if self.visibility.is_some() {
            "ambient visibility"
        } else {
            "indirect light"
        }
    }

    /// What the reference of points of these bounces is, in words: of visibility, which occluders
    /// count.
    pub fn judged_by(&self, bounces: Bounces) -> String {
        let Some(occlusion) = self.visibility else {
            return bounces_text(bounces);
        };
        let within = occlusion.distance_m.map_or(String::new(), |distance_m| {
            format!(" within {distance_m} m")
        });
        let falloff = match occlusion.falloff {
            0.0 => String::new(),
            falloff => format!(", 1/(1 + {falloff} r)"),
        };
        format!("visibility{within}{falloff}")
    }

    /// The bounces of the reference of a case: visibility has none, and takes one for all.
    pub fn bounces_of(&self, case: &Case) -> Bounces {
        if self.visibility.is_some() {
            Bounces::Count(1)
        } else {
            bounces_of(case)
        }
    }

    /// The key of a case: a hash of all that its result depends on.
    pub fn key(&self, case: &Case) -> String {
        let settings: Vec<String> = case
            .settings
            .iter()
            .map(|(name, value)| format!("{name}={}", value_text(&value)))
            .collect();
        self.hash(&format!("{} {settings:?}", case.entry.name))
    }

    /// The key of the reference at this number of bounces.
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

impl Versioned for Point {
    const COMMAND: &'static str = "lumivox chart";
    const VERSION: u32 = RECORD_VERSION;

    fn version(&self) -> u32 {
        self.record_version
    }
}

impl Keyed for Point {
    fn key(&self) -> &str {
        &self.key
    }

    fn round(&self) -> u32 {
        self.round.unwrap_or(0)
    }
}

impl PointError {
    /// `None` where nothing was to be seen in the reference, so that there is nothing to be
    /// relative to.
    fn of(errors: &Errors) -> Option<Self> {
        let Errors {
            rel_rmse,
            bias,
            mean_reference,
            ..
        } = *errors;
        (mean_reference > 0.0 && rel_rmse.is_finite() && bias.is_finite())
            .then_some(PointError { rel_rmse, bias })
    }
}

/// The bounces that a case computes.
pub fn bounces_of(case: &Case) -> Bounces {
    (case.entry.bounces)(&case.settings).map_or(Bounces::Full, Bounces::Count)
}

impl Point {
    /// What a report says of a case.
    pub fn new(setup: &SweepSetup, case: &Case, report: &Report) -> Self {
        let text = |(name, value): (&str, _)| (name.to_owned(), value_text(&value));
        let error = report.error.as_ref();
        let (in_blocks, noise_share) = match error.map(|error| error.block) {
            Some(Some(block)) => (Some(block), 1.0 / f64::from(BLOCK_PX)),
            _ => (error.map(|error| error.pixel), 1.0),
        };
        let point_error = in_blocks.as_ref().and_then(PointError::of);
        let is_dark =
            error.is_some() && point_error.is_none() && setup.bounces_of(case) != Bounces::Count(0);
        let dark = || {
            let what = setup.compared();
            format!("the reference shows no {what}, to which an error could be relative")
        };
        Point {
            record_version: RECORD_VERSION,
            key: setup.key(case),
            round: None,
            scene: report.scene.clone(),
            setup: setup.clone(),
            technique: case.entry.name.to_owned(),
            preset: case.preset.clone(),
            changes: case.changes(),
            settings: case.settings.iter().map(text).collect(),
            voxel_size_m: report.voxel_size_m,
            bounces: setup.bounces_of(case),
            failure: report.failure.clone().or_else(|| is_dark.then(dark)),
            refused: report.refused.clone(),
            totals: report.totals.clone(),
            build: report.build.clone(),
            passes: report.passes.clone(),
            memory_bytes: report.memory_bytes,
            structure_bytes: report.structure_bytes,
            counts: report.counts.clone(),
            error: point_error,
            pixel_error: error.and_then(|error| PointError::of(&error.pixel)),
            flip: error
                .map(|error| f64::from(error.flip.mean))
                .filter(|flip| flip.is_finite()),
            materials: error.map(material_errors).unwrap_or_default(),
            noise: report
                .reference
                .map(|reference| reference.pixel_noise * noise_share)
                .filter(|noise| noise.is_finite()),
        }
    }

    /// One of the totals (ms).
    pub fn total(&self, name: &str) -> Option<Spread> {
        self.totals
            .iter()
            .find(|total| total.name == name)
            .map(|total| total.gpu_ms)
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
                Spread {
                    median: bytes,
                    min: bytes,
                    max: bytes,
                    n: 1,
                }
            }
        };
        (spread.median > 0.0).then_some(spread)
    }

    /// A frame, all passes, where geometry stands still (ms).
    pub fn frame_ms(&self) -> Option<Spread> {
        self.total("frame")
    }

    /// A build and a frame, all passes: everything moves (ms).
    pub fn moving_ms(&self) -> Option<Spread> {
        Some(add(self.total("frame")?, self.total("build")?))
    }

    /// What means over blocks hide, of the size of [`PointError::rel_rmse`]: the error by pixel
    /// without the error over blocks and without the reference's own noise. Grain, silhouettes
    /// and small things. `None` where the picture has no blocks, or there is no error.
    pub fn fine_error(&self) -> Option<f64> {
        let (block, pixel) = (self.error?.rel_rmse, self.pixel_error?.rel_rmse);
        let noise = self.noise.unwrap_or(0.0) * f64::from(BLOCK_PX);
        (self.error != self.pixel_error).then(|| {
            (pixel * pixel - block * block - noise * noise)
                .max(0.0)
                .sqrt()
        })
    }

    /// Its place on a chart; `None` where it has none, as axes are logarithmic.
    pub fn price(&self, cost: Cost) -> Option<Price> {
        let error = self.error?.rel_rmse;
        Some(Price {
            cost: self.cost(cost)?,
            error,
        })
        .filter(|_| error > 0.0)
    }

    /// `resolution`, where the technique has it.
    pub fn resolution(&self) -> Option<&str> {
        self.settings.get(RESOLUTION).map(String::as_str)
    }

    /// Technique, preset and resolution.
    pub fn name(&self) -> String {
        let resolution = self.resolution().map(|resolution| format!("{resolution}³"));
        [
            Some(self.technique.clone()),
            self.preset.clone(),
            resolution,
        ]
        .into_iter()
        .flatten()
        .collect::<Vec<_>>()
        .join(" ")
    }

    /// What differs from the preset, as it would be written on the command line.
    pub fn changes_text(&self) -> String {
        self.changes
            .iter()
            .map(|(name, value)| format!("{name}={value}"))
            .collect::<Vec<_>>()
            .join(" ")
    }

    /// The material with the largest error.
    pub fn worst_material(&self) -> Option<&(String, PointError)> {
        self.materials
            .iter()
            .max_by(|a, b| a.1.rel_rmse.total_cmp(&b.1.rel_rmse))
    }
}

/// Spread of a sum of two that were not measured together: the extremes are added.
fn add(a: Spread, b: Spread) -> Spread {
    Spread {
        median: a.median + b.median,
        min: a.min + b.min,
        max: a.max + b.max,
        n: a.n.min(b.n),
    }
}

/// By blocks; a material that has none is too small to be judged.
fn material_errors(error: &ErrorReport) -> Vec<(String, PointError)> {
    error
        .materials
        .iter()
        .filter_map(|errors| {
            Some((
                errors.material.clone(),
                PointError::of(errors.block.as_ref()?)?,
            ))
        })
        .collect()
}

/// "1 bounce", "2 bounces", "all bounces".
pub fn bounces_text(bounces: Bounces) -> String {
    match bounces {
        Bounces::Count(count) => counted(count as usize, "bounce"),
        Bounces::Full => "all bounces".into(),
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::measure::chart::grid_cases;

    pub(in crate::measure::chart) fn setup() -> SweepSetup {
        SweepSetup {
            scene_hash: "0123".into(),
            size: [160, 120],
            shadow_resolution: 1024,
            shadows: BTreeMap::new(),
            frames: 5,
            rebuilds: 3,
            max_error: 0.01,
            channel: Channel::Luminance,
            visibility: None,
            timing: Timing::Host,
            device: "a device".into(),
            driver: "a driver".into(),
            version: "1".into(),
            build: "abc".into(),
        }
    }

    fn case(preset: &str, set: &str) -> Case {
        let text =
            format!("[[sweep]]\ntechnique = [\"svo\"]\npreset = [\"{preset}\"]\nset = {{ {set} }}");
        grid_cases("test", &text)
            .map(|mut cases| cases.remove(0))
            .unwrap_or_else(|error| panic!("{error}"))
    }

    /// A record is found again only for the same case of the same setup: whatever can change a
    /// figure changes the key.
    /// A chart of visibility says which occluders count, and nothing of bounces.
    #[test]
    fn visibility_is_told_with_its_definition() {
        let of = |visibility| {
            let setup = SweepSetup {
                visibility,
                ..point("lpv", 1, [1.0, 1.0], 0, 0.1).setup
            };
            setup.judged_by(Bounces::Count(1))
        };
        let occluders = |distance_m, falloff| {
            Some(Occlusion {
                distance_m,
                falloff,
            })
        };
        assert_eq!(of(None), "1 bounce");
        assert_eq!(of(occluders(None, 0.0)), "visibility");
        assert_eq!(of(occluders(Some(0.5), 0.0)), "visibility within 0.5 m");
        assert_eq!(of(occluders(None, 2.0)), "visibility, 1/(1 + 2 r)");
    }

    #[test]
    fn keys_tell_everything_apart() {
        let changes: [fn(&mut SweepSetup); 13] = [
            |_| {},
            |setup| setup.scene_hash.push('4'),
            |setup| setup.size = [120, 160],
            |setup| setup.shadow_resolution = 512,
            |setup| setup.frames = 6,
            |setup| setup.rebuilds = 4,
            |setup| setup.max_error = 0.02,
            |setup| setup.channel = Channel::Rgb,
            |setup| setup.timing = Timing::Timestamps,
            |setup| setup.device.push('2'),
            |setup| setup.driver.push('2'),
            |setup| setup.version.push('2'),
            |setup| setup.build.push('2'),
        ];
        let cases = [
            case("cones", ""),
            case("cones", "cones = [9]"),
            case("cones", "bounces = [2]"),
            case("accurate", ""),
        ];
        let mut keys: Vec<String> = Vec::new();
        for change in changes {
            let mut setup = setup();
            change(&mut setup);
            keys.extend(cases.iter().map(|case| setup.key(case)));
            keys.extend(
                [Bounces::Count(1), Bounces::Full].map(|bounces| setup.reference_key(bounces)),
            );
        }
        let count = keys.len();
        keys.sort();
        keys.dedup();
        assert_eq!((keys.len(), count), (13 * 6, 13 * 6));
        assert_eq!(
            setup().key(&case("cones", "gather = [\"rays\"]")),
            setup().key(&case("accurate", "")),
            "a preset is a name for settings"
        );
    }

    /// A point of this name with a time of the gather and a build (ms), bytes and an error.
    pub(in crate::measure::chart) fn point(
        technique: &str,
        bounces: u32,
        [gather, build]: [f64; 2],
        bytes: u64,
        error: f64,
    ) -> Point {
        let total = |name: &str, ms: f64| PassTimes {
            name: name.to_owned(),
            gpu_ms: Spread {
                median: ms,
                min: 0.9 * ms,
                max: 1.2 * ms,
                n: 3,
            },
        };
        let error = PointError {
            rel_rmse: error,
            bias: -0.5 * error,
        };
        Point {
            record_version: RECORD_VERSION,
            key: format!("{technique} {bounces} {gather} {bytes} {}", error.rel_rmse),
            round: None,
            scene: "room".into(),
            setup: setup(),
            technique: technique.into(),
            preset: Some("cones".into()),
            changes: BTreeMap::from([("cones".to_owned(), format!("{gather}"))]),
            settings: BTreeMap::from([("resolution".to_owned(), "64".to_owned())]),
            voxel_size_m: Some(0.125),
            bounces: Bounces::Count(bounces),
            failure: None,
            refused: None,
            totals: vec![
                total("build", build),
                total("indirect", gather + 1.0),
                total("frame", gather + 5.0),
            ],
            build: Vec::new(),
            passes: Vec::new(),
            memory_bytes: 2 * bytes,
            structure_bytes: Some(bytes),
            counts: BTreeMap::new(),
            error: Some(error),
            pixel_error: Some(PointError {
                rel_rmse: error.rel_rmse.hypot(0.016),
                bias: error.bias,
            }),
            flip: Some(0.1),
            materials: vec![
                ("wall".into(), error),
                (
                    "lamp".into(),
                    PointError {
                        rel_rmse: 2.0 * error.rel_rmse,
                        bias: error.rel_rmse,
                    },
                ),
            ],
            noise: Some(0.002),
        }
    }

    #[test]
    fn costs_add_what_they_say() {
        let point = point("svo", 1, [9.0, 5.0], 4096, 0.1);
        let median = |cost| point.cost(cost).map(|spread| spread.median);
        assert_eq!(
            Cost::ALL.map(median),
            [Some(10.0), Some(15.0), Some(4096.0)]
        );
        assert!(point.cost(Cost::Rebuild).is_some_and(
            |spread| (spread.min - 13.5).abs() < 1e-9 && (spread.max - 18.0).abs() < 1e-9
        ));
        assert_eq!(
            point.worst_material().map(|worst| worst.0.as_str()),
            Some("lamp")
        );
        assert_eq!(
            point
                .frame_ms()
                .zip(point.moving_ms())
                .map(|(frame, moving)| (frame.median, moving.median)),
            Some((14.0, 19.0))
        );
    }

    /// Planted: 0.05 of grain beside an error of 0.1 and a reference with a noise of 0.016 by
    /// pixel, 0.002 by block.
    #[test]
    fn grain_is_what_blocks_and_reference_do_not_explain() {
        let mut point = point("svo", 1, [9.0, 5.0], 4096, 0.1);
        assert!(
            point.fine_error().is_some_and(|error| error < 1e-6),
            "{:?}",
            point.fine_error()
        );
        point.pixel_error = Some(PointError {
            rel_rmse: 0.1_f64.hypot(0.016).hypot(0.05),
            bias: 0.0,
        });
        assert!(
            point
                .fine_error()
                .is_some_and(|error| (error - 0.05).abs() < 1e-9),
            "{:?}",
            point.fine_error()
        );
        point.pixel_error = point.error;
        assert_eq!(point.fine_error(), None, "there were no blocks");
    }

    #[test]
    fn records_are_read_as_they_were_written() -> Result<(), serde_json::Error> {
        let mut point = point("svo", 1, [1.0 / 3.0, 0.1 + 0.2], 4096, 1.0 / 7.0);
        point.bounces = Bounces::Full;
        point.setup.max_error = 0.1 + 0.7;
        assert_eq!(
            serde_json::from_str::<Point>(&serde_json::to_string(&point)?)?,
            point
        );
        Ok(())
    }
}
