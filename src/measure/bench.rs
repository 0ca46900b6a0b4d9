//! Benchmarks: cases, and one report for each.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use crate::frame::{FrameSettings, Renderer};
use crate::gi::Settings;
use crate::gi::entry::{Directions, Entry, Part};
use crate::gi::inspect::{DYNAMIC, Energy};
use crate::gi::settings::{RESOLUTION, SettingError};
use crate::graph::{
    Error, FrameStats, Gpu, GpuOptions, HostWork, PassTimes, Spread, TimesAccumulator,
};
use crate::image::{Aov, GuideImage, Image};
use crate::metrics::Channel;
use crate::reference::{self, Bounces, Filter, Occlusion, ReferenceImage, Sampling};
use crate::render::GpuScene;
use crate::scene::{Camera, Scene};
use crate::vulkan::DeviceKind;

use super::clocks::{self, Clocks};
use super::report::{
    DirectionCost, ErrorReport, HostRow, MemoryRow, MotionTimes, ReferenceInfo, Report, Timing,
    shadow_changes,
};
use super::stages::{StageTimes, When, part_ms, stage_times};
use super::table::value_text;
use super::throughput::throughput;
use super::walk::{WalkSettings, WalkTimes, walk};

/// What is measured: one technique with all its settings.
#[derive(Clone)]
pub struct Case {
    /// The technique that is measured.
    pub entry: &'static Entry,
    /// The preset that the settings started from.
    pub preset: Option<String>,
    /// The values of all its settings.
    pub settings: Settings,
}

impl Case {
    /// The settings that differ from the preset's, `resolution` left out, as they would be written
    /// on the command line.
    pub fn changes(&self) -> BTreeMap<String, String> {
        let of_preset = self
            .entry
            .settings::<&str>(self.preset.as_deref(), &[])
            .ok();
        let preset_value = |name: &str| {
            of_preset
                .iter()
                .flat_map(|settings| settings.iter())
                .find(|(key, _)| *key == name)
                .map(|(_, value)| value)
        };
        let is_changed =
            |(name, value): &(&str, _)| *name != RESOLUTION && preset_value(name) != Some(*value);
        self.settings
            .iter()
            .filter(is_changed)
            .map(|(name, value)| (name.to_owned(), value_text(&value)))
            .collect()
    }
}

/// Every technique with each preset at each resolution, `pairs` on top of all. A technique without
/// presets or without a setting `resolution` has one case instead of several; no presets at all
/// stand for each technique's default.
pub fn cases(
    techniques: &[&'static Entry],
    presets: &[String],
    resolutions: &[u32],
    pairs: &[String],
) -> Result<Vec<Case>, SettingError> {
    let mut cases = Vec::new();
    for &entry in techniques {
        let default = entry.presets.first().map(|preset| preset.name.to_owned());
        let presets: Vec<Option<String>> = if presets.is_empty() || default.is_none() {
            vec![default]
        } else {
            presets.iter().cloned().map(Some).collect()
        };
        let has_resolution = entry
            .settings
            .iter()
            .copied()
            .flatten()
            .any(|setting| setting.name == RESOLUTION);
        let resolutions: Vec<Option<u32>> = if resolutions.is_empty() || !has_resolution {
            vec![None]
        } else {
            resolutions.iter().copied().map(Some).collect()
        };
        for preset in &presets {
            for resolution in &resolutions {
                let all: Vec<String> = resolution
                    .iter()
                    .map(|resolution| format!("{RESOLUTION}={resolution}"))
                    .chain(pairs.iter().cloned())
                    .collect();
                cases.push(Case {
                    entry,
                    preset: preset.clone(),
                    settings: entry.settings(preset.as_deref(), &all)?,
                });
            }
        }
    }
    Ok(cases)
}

/// How to measure.
#[derive(Clone, Debug)]
pub struct BenchSettings {
    /// Which device, and how it is opened.
    pub gpu: GpuOptions,
    /// Where times come from.
    pub timing: Timing,
    /// What all techniques share.
    pub frame: FrameSettings,
    /// Whether a frame goes before those that are measured, which may have to compile pipelines.
    pub warm_up: bool,
    /// Frames that are measured, at least 1.
    pub frames: u32,
    /// As long as this has not gone by, more frames are.
    pub at_least: Duration,
    /// Builds after the first.
    pub rebuilds: u32,
    /// Times (s) at which dynamic models are shown, each measured as often as there are builds.
    pub times: Vec<f32>,
    /// Whether as many frames are measured in which nothing but the camera moves.
    pub still: bool,
    /// How a camera walks, where it does.
    pub walk: Option<WalkSettings>,
    /// For how long frames are counted that are waited for, and as long those that are not, where
    /// they are; a run of its own.
    pub throughput: Option<Duration>,
    /// Whether the samples of the gather are counted, which takes a run of its own.
    pub samples: bool,
    /// Whether luminances are compared, or red, green and blue each.
    pub channel: Channel,
    /// The ambient visibility of this definition is compared; `None`: the indirect light is.
    pub visibility: Option<Occlusion>,
}

/// What is compared: the indirect light, or the ambient visibility.
pub fn compared(visibility: Option<Occlusion>) -> Aov {
    if visibility.is_some() {
        Aov::Visibility
    } else {
        Aov::Indirect
    }
}

/// What a scene looks like, and what is compared of it ought to be.
#[derive(Clone, Debug)]
pub struct Truth {
    /// What each pixel sees.
    pub guide: GuideImage,
    /// What [`compared`] says, and where it is from; `None` where no error is wanted.
    pub image: Option<(Image, ReferenceInfo)>,
}

/// Samples per pixel at which a reference is done in any case.
pub const MAX_SPP: u32 = 4096;

impl Truth {
    /// How to render the reference at this number of bounces. `max_error` is the relative standard
    /// error that its 8×8-pixel means may have.
    pub fn settings(
        [width, height]: [u32; 2],
        bounces: Bounces,
        max_error: f64,
        visibility: Option<Occlusion>,
    ) -> reference::Settings {
        let sampling = Sampling::Adaptive {
            max_error: max_error as f32,
            max_spp: MAX_SPP,
        };
        reference::Settings {
            width,
            height,
            bounces,
            filter: Filter::Center,
            sampling,
            seed: 0,
            occlusion: visibility.unwrap_or_default(),
        }
    }

    /// What a reference shows.
    pub fn of(image: ReferenceImage, bounces: Bounces, visibility: Option<Occlusion>) -> Self {
        let noise = match visibility {
            Some(_) => image.visibility_error(),
            None => image.indirect_error(),
        };
        let info = ReferenceInfo {
            bounces,
            samples_per_pixel: image.mean_samples(),
            pixel_noise: f64::from(noise.pixel),
        };
        Truth {
            image: image.aov(compared(visibility)).map(|image| (image, info)),
            guide: image.guide,
        }
    }
}

/// The first picture of a case that is as it stays; `lumivox render --frames` gives the same.
#[derive(Clone, Debug)]
pub struct Pictures {
    /// Outgoing radiance [W/(m² sr)].
    pub full: Image,
    /// What is compared.
    pub compared: Image,
}

/// How a device is best timed: by its timestamps, unless it runs on the CPU. Lavapipe's do not
/// follow what it executes.
pub fn choose_timing(options: &GpuOptions) -> Result<Timing, Error> {
    Ok(if on_cpu(options)? {
        Timing::Host
    } else {
        Timing::Timestamps
    })
}

/// Whether the device that these open runs on the CPU.
pub fn on_cpu(options: &GpuOptions) -> Result<bool, Error> {
    Ok(Gpu::new(options)?.info().kind == DeviceKind::Cpu)
}

/// Measures one case on a device of its own, so that every first build compiles its pipelines. What
/// the device refuses is told in the report; an error is that there is no device.
pub fn measure(
    scene: &Scene,
    case: &Case,
    settings: &BenchSettings,
    truth: &Truth,
) -> Result<Report, Error> {
    let gpu = open(&settings.gpu, settings.timing)?;
    let (mut report, _) = measure_on(&gpu, &mut None, scene, case, settings, truth);
    drop(gpu);
    if let Some(budget) = settings.throughput.filter(|_| report.failure.is_none()) {
        report.throughput = Some(throughput(scene, case, settings, budget)?);
    }
    Ok(report)
}

/// Opens a device, for times of this kind.
pub fn open(options: &GpuOptions, timing: Timing) -> Result<Gpu, Error> {
    Gpu::new(&GpuOptions {
        isolate_passes: timing == Timing::Host,
        // What is built is measured.
        cache_dir: None,
        ..options.clone()
    })
}

/// As [`measure`], on a device that is open: its pipelines may be compiled already. `uploaded`
/// keeps the scene on the device from case to case, and is empty at first; it may be of the same
/// scene with another camera. Beside the report, which tells a failure too, there are the pictures
/// or the failure itself.
pub fn measure_on(
    gpu: &Gpu,
    uploaded: &mut Option<GpuScene>,
    scene: &Scene,
    case: &Case,
    settings: &BenchSettings,
    truth: &Truth,
) -> (Report, Result<Pictures, Error>) {
    let run = match run(gpu, uploaded.take(), scene, case, settings) {
        Ok(run) => run,
        Err(failure) => {
            let report = Report {
                failure: Some(failure.to_string()),
                refused: refused(&failure),
                ..empty_report(gpu, scene, case, settings)
            };
            return (report, Err(failure));
        }
    };
    let mut report = run.report(gpu, scene, case, settings, truth);
    if let Some((reference, info)) = &truth.image {
        match ErrorReport::of(
            compared(settings.visibility),
            [&run.pictures.compared, reference],
            scene,
            &truth.guide,
            settings.channel,
        ) {
            Ok(error) => (report.error, report.reference) = (Some(error), Some(*info)),
            Err(source) => {
                report.failure = Some(format!(
                    "{} cannot be compared with the reference: {source}",
                    case.entry.name
                ))
            }
        }
    }
    *uploaded = Some(run.renderer.into_scene());
    (report, Ok(run.pictures))
}

/// What was too large, and its bytes.
fn refused(failure: &Error) -> Option<MemoryRow> {
    match failure {
        Error::TooLarge {
            resource, wanted, ..
        }
        | Error::OutOfMemory {
            resource, wanted, ..
        } => Some(MemoryRow {
            name: resource.clone(),
            bytes: *wanted,
        }),
        _ => None,
    }
}

fn empty_report(gpu: &Gpu, scene: &Scene, case: &Case, settings: &BenchSettings) -> Report {
    Report {
        preset: case.preset.clone(),
        shadow_resolution: Some(settings.frame.shadows.resolution),
        shadows: shadow_changes(&settings.frame.shadows),
        ..Report::new(
            gpu,
            &scene.name,
            settings.frame.size,
            case.entry.name,
            &case.settings,
        )
    }
}

/// What a case gave before it is summed up.
struct Run<'g> {
    first_build: FrameStats,
    builds: Vec<FrameStats>,
    frames: Vec<FrameStats>,
    clocks: Option<Clocks>,
    still: Vec<FrameStats>,
    motion: Vec<MotionTimes>,
    walks: Vec<WalkTimes>,
    pictures: Pictures,
    counts: Vec<(&'static str, u64)>,
    energy: Option<Energy>,
    /// Samples of the gather, by pass.
    samples: Vec<(&'static str, u64)>,
    /// Alive until memory has been listed.
    renderer: Renderer<'g>,
}

fn run<'g>(
    gpu: &'g Gpu,
    uploaded: Option<GpuScene>,
    scene: &Scene,
    case: &Case,
    settings: &BenchSettings,
) -> Result<Run<'g>, Error> {
    let mut uploaded = uploaded.map_or_else(|| GpuScene::new(gpu, scene), Ok)?;
    uploaded.eye = scene.camera.eye;
    let (mut renderer, first_build) =
        Renderer::of(gpu, uploaded, case.entry, &case.settings, settings.frame)?;
    let before = match settings.warm_up {
        true => warm_up_frames(case),
        false => case.entry.rest(&case.settings) - 1,
    };
    (0..before).try_for_each(|_| renderer.render(&scene.camera).map(drop))?;
    let mut frames = vec![renderer.render(&scene.camera)?];
    // However many frames are measured: with history they are not the same.
    let pictures = Pictures {
        full: renderer.aov(Aov::Full)?,
        compared: renderer.aov(compared(settings.visibility))?,
    };
    if gpu.info().kind != DeviceKind::Cpu {
        raise_clocks(&mut renderer, scene)?;
        frames.clear();
    }
    let began = Instant::now();
    while frames.len() < settings.frames as usize || began.elapsed() < settings.at_least {
        frames.push(renderer.render(&scene.camera)?);
    }
    let clocks = clocks::read(gpu.info());
    let counts = renderer.counts_of_report()?;
    let energy = if settings.samples {
        renderer.energy()?
    } else {
        None
    };
    let samples = if settings.samples {
        renderer.count_samples()?
    } else {
        Vec::new()
    };
    let still = if settings.still {
        still_frames(&mut renderer, scene, settings.frames)?
    } else {
        Vec::new()
    };
    let builds = (0..settings.rebuilds)
        .map(|_| renderer.rebuild())
        .collect::<Result<_, _>>()?;
    let motion = motion(gpu, &mut renderer, scene, settings)?;
    let walks = settings
        .walk
        .iter()
        .map(|settings| walk(&mut renderer, scene, case.entry, settings))
        .collect::<Result<Vec<_>, _>>()?
        .concat();
    Ok(Run {
        first_build,
        builds,
        frames,
        clocks,
        still,
        motion,
        walks,
        pictures,
        counts,
        energy,
        samples,
        renderer,
    })
}

/// Frames in which nothing but the camera moves: to its side, by a thousandth of its distance to
/// what it looks at.
fn still_frames(
    renderer: &mut Renderer<'_>,
    scene: &Scene,
    frames: u32,
) -> Result<Vec<FrameStats>, Error> {
    let camera = scene.camera;
    let [right, ..] = camera.basis();
    let step = 1e-3 * (camera.target - camera.eye).length() * right;
    let moved = |frame: u32| Camera {
        eye: camera.eye + frame as f32 * step,
        target: camera.target + frame as f32 * step,
        ..camera
    };
    (1..=frames)
        .map(|frame| renderer.render_again(&moved(frame)))
        .collect()
}

/// For so long a GPU is kept busy before times count.
const WARM_UP: Duration = Duration::from_millis(400);

/// Renders until a GPU that has been idle has its full clocks. An H200 begins at 345 of 1980 MHz,
/// and its first frames take up to eleven times as long.
fn raise_clocks(renderer: &mut Renderer<'_>, scene: &Scene) -> Result<(), Error> {
    let start = Instant::now();
    while start.elapsed() < WARM_UP {
        renderer.render(&scene.camera)?;
    }
    Ok(())
}

/// How long before and after a time models are moved away from where they are then (s).
const NUDGE_S: f32 = 1e-3;

/// Puts the scene's models where they are at each time, several times; the first may have to make
/// buffers larger and is not counted.
fn motion(
    gpu: &Gpu,
    renderer: &mut Renderer<'_>,
    scene: &Scene,
    settings: &BenchSettings,
) -> Result<Vec<MotionTimes>, Error> {
    let mut moved = scene.clone();
    let mut rows = Vec::new();
    for &time_s in &settings.times {
        let mut pose = |time_s: f32| {
            moved.set_time(time_s);
            let mut stats = renderer.set_pose(&moved)?;
            // What would go with the next frame.
            stats.append(gpu.submit_waiting()?);
            Ok(stats)
        };
        // Models that stand cost nothing: they come from a little before, or after where they
        // begin to move then.
        let mut come = || -> Result<FrameStats, Error> {
            pose(time_s - NUDGE_S)?;
            let stats = pose(time_s)?;
            if !stats.passes.is_empty() {
                return Ok(stats);
            }
            pose(time_s + NUDGE_S)?;
            pose(time_s)
        };
        come()?;
        let runs = (0..settings.rebuilds)
            .map(|_| come())
            .collect::<Result<Vec<FrameStats>, _>>()?;
        let Some(gpu_ms) = Spread::of(&runs.iter().map(FrameStats::total_ms).collect::<Vec<f64>>())
        else {
            continue;
        };
        let dynamic_voxels = renderer
            .counts()?
            .into_iter()
            .find(|(name, _)| *name == DYNAMIC)
            .map(|(_, count)| count);
        rows.push(MotionTimes {
            time_s,
            dynamic_voxels,
            gpu_ms,
            passes: self::rows(&runs),
        });
    }
    Ok(rows)
}

/// Frames before those that are measured: the first may have to compile pipelines.
pub(super) fn warm_up_frames(case: &Case) -> u32 {
    (case.entry.rest(&case.settings) - 1).max(1)
}

impl Run<'_> {
    fn report(
        &self,
        gpu: &Gpu,
        scene: &Scene,
        case: &Case,
        settings: &BenchSettings,
        truth: &Truth,
    ) -> Report {
        let passes = rows(&self.frames);
        let stages: Vec<StageTimes> = [(When::Build, &self.builds), (When::Frame, &self.frames)]
            .into_iter()
            .flat_map(|(when, runs)| stage_times(case.entry, when, runs))
            .collect();
        let mut report = Report {
            voxel_size_m: self.renderer.cell_size(),
            counting: PassTimes::once(&self.first_build.counting),
            first_build: PassTimes::once(&self.first_build.passes),
            build: rows(&self.builds),
            directions: direction_costs(&passes, case, scene, &truth.guide, &self.samples),
            motion: self.motion.clone(),
            walks: self.walks.clone(),
            passes,
            still: rows(&self.still),
            clocks: self.clocks.clone(),
            host: host_rows([
                ("build", &self.builds),
                ("frame", &self.frames),
                ("still", &self.still),
            ]),
            totals: totals(
                &stages,
                [&self.builds, &self.frames, &self.still],
                case.entry,
            ),
            stages,
            ..empty_report(gpu, scene, case, settings)
        };
        report.set_counts(&self.counts);
        report.set_energy(self.energy);
        report
    }
}

fn rows(stats: &[FrameStats]) -> Vec<PassTimes> {
    let mut times = TimesAccumulator::default();
    stats.iter().for_each(|stats| times.add(&stats.passes));
    times.rows()
}

fn host_rows(runs: [(&str, &[FrameStats]); 3]) -> Vec<HostRow> {
    let row = |(of, runs): (&str, &[FrameStats])| {
        let work = runs.iter().map(|stats| stats.host).reduce(HostWork::max)?;
        let of = of.to_owned();
        Some(HostRow { of, work })
    };
    runs.into_iter().filter_map(row).collect()
}

fn totals(
    stages: &[StageTimes],
    [builds, frames, still]: [&[FrameStats]; 3],
    entry: &Entry,
) -> Vec<PassTimes> {
    let all = |name: &str, runs: &[FrameStats]| {
        let gpu_ms = Spread::of(&runs.iter().map(FrameStats::total_ms).collect::<Vec<f64>>())
            .filter(|_| runs.iter().any(|run| !run.passes.is_empty()))?;
        Some(PassTimes {
            name: name.to_owned(),
            gpu_ms,
        })
    };
    let parts = |name: &str, parts: &[Part]| {
        let ran = stages.iter().any(|stage| {
            stage.part.is_some_and(|part| parts.contains(&part)) && stage.when == When::Frame
        });
        let sum = |frame: &FrameStats| parts.iter().map(|part| part_ms(entry, frame, *part)).sum();
        let gpu_ms = Spread::of(&frames.iter().map(sum).collect::<Vec<f64>>()).filter(|_| ran)?;
        Some(PassTimes {
            name: name.to_owned(),
            gpu_ms,
        })
    };
    let totals = [
        all("build", builds),
        parts("update", &[Part::Store]),
        parts("gather", &[Part::Picture]),
        parts("indirect", &[Part::Store, Part::Picture]),
        parts("shared", &[Part::Shared]),
        all("frame", frames),
        all("still", still),
    ];
    totals.into_iter().flatten().collect()
}

fn directions_of(entry: &Entry, pass: &str) -> Option<&'static Directions> {
    entry
        .directions
        .iter()
        .find(|directions| directions.pass.name == pass)
}

fn direction_costs(
    passes: &[PassTimes],
    case: &Case,
    scene: &Scene,
    guide: &GuideImage,
    samples: &[(&str, u64)],
) -> Vec<DirectionCost> {
    let surfaces: Vec<usize> = (0..guide.material.len())
        .filter(|&index| guide.is_surface(index))
        .collect();
    let is_glossy = |index: &&usize| {
        scene
            .materials
            .get(guide.material[**index] as usize)
            .is_some_and(|material| material.specular.is_some())
    };
    let cost = |pass: &PassTimes| {
        let (directions, pixels) = match directions_of(case.entry, &pass.name)?.count {
            Some(count) => (count(&case.settings), surfaces.len()),
            None => (1, surfaces.iter().filter(is_glossy).count()),
        };
        let us = pass.gpu_ms.median * 1e3;
        let samples = samples
            .iter()
            .find(|(name, _)| *name == pass.name)
            .map(|(_, samples)| *samples)
            .filter(|samples| *samples > 0);
        (pixels > 0).then(|| DirectionCost {
            pass: pass.name.clone(),
            directions,
            pixels,
            us_per_direction: us / (f64::from(directions) * pixels as f64),
            samples,
            us_per_sample: samples.map(|samples| us / samples as f64),
        })
    };
    passes.iter().filter_map(cost).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gi::registry::{TECHNIQUES, find};
    use crate::graph::PassTime;

    fn stats(passes: &[(&str, f64)]) -> FrameStats {
        let pass = |(name, gpu_ms): &(&str, f64)| PassTime {
            name: (*name).to_owned(),
            gpu_ms: *gpu_ms,
            runs: 1,
        };
        FrameStats {
            passes: passes.iter().map(pass).collect(),
            ..FrameStats::default()
        }
    }

    #[test]
    fn totals_add_the_parts() -> Result<(), Box<dyn std::error::Error>> {
        let builds = [stats(&[
            ("voxel.clear", 1.0),
            ("voxel.fragments", 4.0),
            ("voxel_mips.clear", 7.0),
        ])];
        let frames = [
            stats(&[
                ("voxel.light", 1.0),
                ("voxel_mips.filter", 2.0),
                ("cone.gather", 8.0),
                ("render.rsm", 50.0),
            ]),
            stats(&[("cone.gather", 10.0)]),
        ];
        let entry = find("voxel-mips")?;
        let totals = totals(
            &stage_times(entry, When::Frame, &frames),
            [&builds, &frames, &[stats(&[("cone.gather", 7.0)])]],
            entry,
        );
        let median = |name: &str| {
            totals
                .iter()
                .find(|total| total.name == name)
                .map(|total| total.gpu_ms.median)
        };
        let names = [
            "build", "update", "gather", "indirect", "shared", "frame", "still",
        ];
        assert_eq!(
            names.map(median),
            [
                Some(12.0),
                Some(1.5),
                Some(9.0),
                Some(10.5),
                Some(25.0),
                Some(35.5),
                Some(7.0)
            ]
        );
        Ok(())
    }

    #[test]
    fn directions_are_of_a_techniques_own_passes_and_settings() {
        for entry in TECHNIQUES {
            for directions in entry.directions {
                assert!(
                    entry
                        .passes
                        .iter()
                        .copied()
                        .flatten()
                        .any(|pass| std::ptr::eq(*pass, directions.pass)),
                    "{}",
                    directions.pass.name
                );
                let settings = entry.settings::<&str>(None, &[]);
                assert!(
                    settings.is_ok_and(|settings| directions
                        .count
                        .is_none_or(|count| count(&settings) > 0)),
                    "{}",
                    directions.pass.name
                );
            }
        }
    }

    #[test]
    fn every_technique_has_a_default_case() {
        assert!(
            cases(TECHNIQUES, &[], &[], &[]).is_ok_and(|cases| cases.len() == TECHNIQUES.len())
        );
    }

    #[test]
    fn cases_are_the_product() -> Result<(), Box<dyn std::error::Error>> {
        let presets = ["cones".to_owned(), "textbook".to_owned()];
        let all = cases(
            &[find("voxel-mips")?, find("none")?],
            &presets,
            &[16, 32, 64],
            &[],
        )?;
        assert_eq!(all.len(), 7);
        assert_eq!(all[4].settings.count("resolution"), 32);
        assert_eq!(all[4].preset.as_deref(), Some("textbook"));
        Ok(())
    }
}
