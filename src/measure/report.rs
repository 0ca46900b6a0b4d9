//! The report: one JSON object for one run.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::gi::Settings;
use crate::gi::inspect::{Energy, OCCUPIED};
use crate::gi::settings::Value;
use crate::graph::{Gpu, HostWork, Owner, PassTimes, ScreenFormat, Spread};
use crate::image::{Aov, GuideImage, Image};
use crate::metrics::{
    Channel, Comparison, Errors, Flip, MaterialErrors, MetricError, compare, exposure_of, flip,
};
use crate::output::write_text;
use crate::reference::Bounces;
use crate::render::ShadowSettings;
use crate::scene::Scene;

use super::clocks::Clocks;
use super::records::Versioned;
use super::stages::StageTimes;
use super::throughput::Throughput;
use super::walk::WalkTimes;

/// Version of the report's form; a change of meaning raises it.
pub const SCHEMA_VERSION: u32 = 1;

/// Bytes of one resource.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct MemoryRow {
    /// Name of the buffer or image.
    pub name: String,
    /// Bytes that it needs on the device.
    pub bytes: u64,
}

/// Where pass times come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Timing {
    /// Every pass submitted by itself and timed on the host, its submission included.
    Host,
    /// The device's timestamps around each pass.
    Timestamps,
}

/// One account of where light is and has gone.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct EnergyRow {
    /// `injected`, `entered`, `absorbed`, `left`, `on_its_way` or `lost`: the first two less the
    /// others but this.
    pub name: String,
    /// Flux, red, green, blue (W).
    pub watts: [f64; 3],
}

/// Error on the surfaces of one material.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MaterialError {
    /// Name of the material.
    pub material: String,
    /// Over its pixels.
    pub pixel: Errors,
    /// Over its blocks, where it has any.
    pub block: Option<Errors>,
}

/// Error of one output against a reference.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ErrorReport {
    /// Name of the output that was compared, such as `indirect`.
    pub aov: String,
    /// Whether luminances were compared, or red, green and blue each.
    pub channel: Channel,
    /// Over all pixels that see a surface.
    pub pixel: Errors,
    /// Over block means, where there are blocks.
    pub block: Option<Errors>,
    /// ꟻLIP of the whole image, tone-mapped.
    pub flip: Flip,
    /// `pixel` and `block` by material, most pixels first.
    pub materials: Vec<MaterialError>,
}

impl ErrorReport {
    /// Compares an image of a scene with its reference; `guide` says what each pixel sees.
    pub fn of(
        aov: Aov,
        [image, reference]: [&Image; 2],
        scene: &Scene,
        guide: &GuideImage,
        channel: Channel,
    ) -> Result<Self, MetricError> {
        let Comparison {
            channel,
            pixel,
            block,
            materials,
        } = compare(image, reference, Some(guide), channel)?;
        let flip = flip(image, reference, exposure_of(reference))?;
        Ok(ErrorReport {
            aov: aov.name().to_owned(),
            channel,
            pixel,
            block,
            flip,
            materials: named(materials, scene),
        })
    }
}

/// Errors by material, with their names in the scene.
pub(crate) fn named(materials: Vec<MaterialErrors>, scene: &Scene) -> Vec<MaterialError> {
    let name = |index: u32| {
        scene
            .materials
            .get(index as usize)
            .map_or_else(|| index.to_string(), |material| material.name.clone())
    };
    let materials = materials.into_iter().map(|errors| MaterialError {
        material: name(errors.material),
        pixel: errors.pixel,
        block: errors.block,
    });
    materials.collect()
}

impl MaterialError {
    /// Over blocks where there are blocks, else over pixels.
    pub fn errors(&self) -> Errors {
        self.block.unwrap_or(self.pixel)
    }
}

/// The reference that an error was taken against, and its own noise: no error below that noise
/// means anything.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ReferenceInfo {
    /// Indirect bounces; `full` for all of them.
    pub bounces: Bounces,
    /// Mean number of samples per pixel.
    pub samples_per_pixel: f64,
    /// Standard error of the indirect radiance of a pixel, relative to the image's mean.
    pub pixel_noise: f64,
}

/// What one direction of a gather costs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DirectionCost {
    /// Name of the pass.
    pub pass: String,
    /// Beams that each pixel casts.
    pub directions: u32,
    /// Pixels that gather.
    pub pixels: usize,
    /// Median time of the pass / (pixels × directions) (µs).
    pub us_per_direction: f64,
    /// Samples that its beams take in one picture, samples that skip empty space included; `None`
    /// where they are not counted.
    pub samples: Option<u64>,
    /// Median time of the pass / samples (µs).
    pub us_per_sample: Option<f64>,
}

/// What it costs to bring the structure up to the dynamic models at one time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MotionTimes {
    /// Time at which the models are shown (s).
    pub time_s: f32,
    /// Cells that dynamic models touch then, where the technique counts them.
    pub dynamic_voxels: Option<u64>,
    /// All passes, from the vertices on.
    pub gpu_ms: Spread,
    /// GPU time of each pass.
    pub passes: Vec<PassTimes>,
}

/// What the host did beside recording, at most, in the frames or builds of one kind.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct HostRow {
    /// `build`, `frame` or `still`.
    pub of: String,
    /// What it did.
    #[serde(flatten)]
    pub work: HostWork,
}

/// How a scene goes on from frame to frame. Times of passes are medians over all frames but the
/// first; picture, counts and errors are those of the last.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SequenceRow {
    /// Frames, 2 or more.
    pub frames: u32,
    /// Frames a second; `None` where models stand still.
    pub fps: Option<f32>,
    /// Time at which the last is shown (s).
    pub last_time_s: Option<f32>,
    /// How far the camera turns to the left in each frame (degrees).
    pub pan_deg: f32,
    /// How far it then moves ahead (m).
    pub dolly_m: f32,
}

/// What one run measured, as `lumivox bench` and `lumivox render` write it.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Report {
    /// [`SCHEMA_VERSION`].
    pub schema_version: u32,
    /// Version of the program.
    pub version: String,
    /// Commit that the program was built from, where it is known.
    pub commit: Option<String>,
    /// Name of the device.
    pub device: String,
    /// Driver and its version, that it traces rays, and that light is in RGBA16F, where so.
    pub driver: String,
    /// Name of the scene.
    pub scene: String,
    /// Time at which it is shown (s), where one was asked for; of a sequence, its first frame.
    pub time_s: Option<f32>,
    /// How it goes on from frame to frame, where it does.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sequence: Option<SequenceRow>,
    /// Width and height (px).
    pub size: [u32; 2],
    /// Width and height of each shadow map (texels), where it is known.
    pub shadow_resolution: Option<u32>,
    /// Settings of shadows that are not the defaults, by name.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub shadows: BTreeMap<String, String>,
    /// Name of the technique.
    pub technique: String,
    /// Preset that the settings started from, where it is known.
    pub preset: Option<String>,
    /// What was set for the scene on top of the preset, and why, where the choice was left open.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub suited: Option<String>,
    /// All settings of the technique and their values.
    pub settings: BTreeMap<String, Value>,
    /// Edge of its finest cells (m), where it has any and it is known.
    #[serde(default)]
    pub voxel_size_m: Option<f32>,
    /// Where the times come from, where it is known.
    pub timing: Option<Timing>,
    /// Why there is nothing below: what the device refused.
    pub failure: Option<String>,
    /// If memory did not suffice: what was too large, and its bytes.
    pub refused: Option<MemoryRow>,
    /// The counting runs of the first build. They only find out how large its buffers have to be
    /// (and how its work has to be split). Their pipelines are compiled already, and no other row
    /// includes them.
    pub counting: Vec<PassTimes>,
    /// Building for the first time, with the other pipelines compiled; empty where it was not told
    /// apart.
    pub first_build: Vec<PassTimes>,
    /// Building the static structure: GPU time of each pass.
    pub build: Vec<PassTimes>,
    /// Each pass of a frame, in order.
    pub passes: Vec<PassTimes>,
    /// Each pass of frames in which nothing but the camera moves. What such frames keep is not
    /// there; what they did not keep in some of them is, with their number as n.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub still: Vec<PassTimes>,
    /// What the host did in builds, frames and frames in which nothing but the camera moves.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub host: Vec<HostRow>,
    /// Each stage of a build, then of a frame, in the technique's order.
    pub stages: Vec<StageTimes>,
    /// Sums over passes: `build`, all of a build; of a frame `update` (the store), `gather` (the
    /// picture), `indirect` (both), `shared`, and `frame`, all of it; `still`, all of a frame in
    /// which nothing but the camera moves.
    pub totals: Vec<PassTimes>,
    /// What one direction costs.
    pub directions: Vec<DirectionCost>,
    /// What dynamic models cost, by time.
    pub motion: Vec<MotionTimes>,
    /// What a camera that walks costs, by speed.
    #[serde(default)]
    pub walks: Vec<WalkTimes>,
    /// Clocks of the device right after the frames, where they can be read.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub clocks: Option<Clocks>,
    /// Frames a second, where they were counted.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub throughput: Option<Throughput>,
    /// Every buffer and image on the device, in order of creation; equal names are summed.
    pub memory: Vec<MemoryRow>,
    /// Their sum, as the allocator counts it.
    pub memory_bytes: u64,
    /// What the technique keeps in the world, for each occupied cell (bytes); where it counts
    /// them.
    #[serde(default)]
    pub bytes_per_occupied_voxel: Option<f64>,
    /// Bytes of what the technique keeps in the world; `None` where it keeps nothing.
    #[serde(default)]
    pub structure_bytes: Option<u64>,
    /// Counts, by name.
    pub counts: BTreeMap<String, u64>,
    /// Where the light is and has gone; empty where the technique does not count it, or was not
    /// asked to.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub energy: Vec<EnergyRow>,
    /// The reference, where it was rendered for this.
    pub reference: Option<ReferenceInfo>,
    /// The reference's file, where it was given; what in its path is not UTF-8 is U+FFFD.
    pub reference_file: Option<String>,
    /// Error against the reference, where there was one.
    pub error: Option<ErrorReport>,
}

impl Versioned for Report {
    const COMMAND: &'static str = "lumivox bench";
    const VERSION: u32 = SCHEMA_VERSION;

    fn version(&self) -> u32 {
        self.schema_version
    }
}

/// A report that could not be written.
#[derive(Debug, thiserror::Error)]
#[error(
    "cannot write the report {}: {source}; check that the folder exists, is writable and has space",
    path.display()
)]
pub struct ReportError {
    path: PathBuf,
    source: std::io::Error,
}

/// Memory in use, by name; the last row is what the allocator spends on alignment, so that the sum
/// is the allocator's own.
pub fn memory_rows(gpu: &Gpu) -> Vec<MemoryRow> {
    let mut rows: Vec<MemoryRow> = Vec::new();
    for (name, bytes) in gpu.memory() {
        match rows.iter_mut().find(|row| row.name == name) {
            Some(row) => row.bytes += bytes,
            None => rows.push(MemoryRow { name, bytes }),
        }
    }
    let known: u64 = rows.iter().map(|row| row.bytes).sum();
    match gpu.memory_total().saturating_sub(known) {
        0 => {}
        bytes => rows.push(MemoryRow {
            name: "allocator.alignment".into(),
            bytes,
        }),
    }
    rows
}

/// Settings of shadows that are not the defaults, by name.
pub fn shadow_changes(shadows: &ShadowSettings) -> BTreeMap<String, String> {
    let changes = shadows.changes().into_iter();
    changes
        .map(|(name, value)| (name.to_owned(), value))
        .collect()
}

/// Such settings behind the size of shadow maps.
pub(super) fn shadow_text(changes: &BTreeMap<String, String>) -> String {
    let changes = changes.iter();
    changes
        .map(|(name, value)| format!(", {} {value}", name.replace('-', " ")))
        .collect()
}

/// Driver and its version, whether it traces rays, and whether light is kept in 16 bits: then its
/// times are of other work.
pub(crate) fn driver_of(gpu: &Gpu) -> String {
    let rays = if gpu.traces_rays() {
        ", which traces rays"
    } else {
        ""
    };
    let light = match gpu.screen_format() {
        ScreenFormat::Float32 => "",
        ScreenFormat::Float16 => ", light in RGBA16F",
    };
    format!("{}{rays}{light}", gpu.info().driver)
}

impl Report {
    /// Whether two reports are of the same work on the same device.
    pub fn is_same_case(&self, other: &Report) -> bool {
        let case = |report: &Report| {
            (
                report.scene.clone(),
                (report.time_s.map(f32::to_bits), report.sequence.clone()),
                report.size,
                (report.shadow_resolution, report.shadows.clone()),
                (report.technique.clone(), report.preset.clone()),
                (report.device.clone(), report.driver.clone()),
            )
        };
        case(self) == case(other) && self.settings == other.settings
    }

    /// Sets the counts, and what follows from them.
    pub fn set_counts(&mut self, counts: &[(&'static str, u64)]) {
        self.counts = counts
            .iter()
            .map(|(name, count)| ((*name).to_owned(), *count))
            .collect();
        let cells = self
            .counts
            .get(OCCUPIED)
            .copied()
            .filter(|cells| *cells > 0);
        self.bytes_per_occupied_voxel =
            cells.and_then(|cells| Some(self.structure_bytes? as f64 / cells as f64));
    }

    /// Sets where the light is and has gone.
    pub fn set_energy(&mut self, energy: Option<Energy>) {
        let rows = energy.iter().flat_map(Energy::rows);
        self.energy = rows
            .map(|(name, watts)| EnergyRow {
                name: name.to_owned(),
                watts: watts.to_array(),
            })
            .collect();
    }

    /// A report without times, counts and error.
    pub fn new(
        gpu: &Gpu,
        scene: &str,
        size: [u32; 2],
        technique: &str,
        settings: &Settings,
    ) -> Self {
        let info = gpu.info();
        let memory = memory_rows(gpu);
        Report {
            schema_version: SCHEMA_VERSION,
            version: env!("CARGO_PKG_VERSION").to_owned(),
            commit: option_env!("LUMIVOX_COMMIT").map(str::to_owned),
            device: info.name.clone(),
            driver: driver_of(gpu),
            scene: scene.to_owned(),
            time_s: None,
            sequence: None,
            size,
            shadow_resolution: None,
            shadows: BTreeMap::new(),
            technique: technique.to_owned(),
            preset: None,
            suited: None,
            settings: settings
                .iter()
                .map(|(name, value)| (name.to_owned(), value))
                .collect(),
            voxel_size_m: None,
            timing: Some(if gpu.isolates_passes() {
                Timing::Host
            } else {
                Timing::Timestamps
            }),
            failure: None,
            refused: None,
            counting: Vec::new(),
            first_build: Vec::new(),
            build: Vec::new(),
            passes: Vec::new(),
            still: Vec::new(),
            host: Vec::new(),
            stages: Vec::new(),
            totals: Vec::new(),
            directions: Vec::new(),
            motion: Vec::new(),
            walks: Vec::new(),
            clocks: None,
            throughput: None,
            memory_bytes: gpu.memory_total(),
            memory,
            bytes_per_occupied_voxel: None,
            structure_bytes: Some(gpu.bytes_of(Owner::Store)).filter(|bytes| *bytes > 0),
            counts: BTreeMap::new(),
            energy: Vec::new(),
            reference: None,
            reference_file: None,
            error: None,
        }
    }

    /// Writes it as JSON.
    pub fn write(&self, path: &Path) -> Result<(), ReportError> {
        let text = serde_json::to_string_pretty(self).map_err(std::io::Error::other);
        text.and_then(|text| write_text(path, &(text + "\n")))
            .map_err(|source| ReportError {
                path: path.to_owned(),
                source,
            })
    }
}
