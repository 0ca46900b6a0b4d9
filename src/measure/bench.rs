//! Benchmarks: cases, and one report for each.

use crate::frame::{FrameSettings, Renderer};
use crate::gi::Settings;
use crate::gi::registry::{Directions, Entry, Part};
use crate::gi::settings::{SettingError, Value};
use crate::graph::{DeviceChoice, Error, FrameStats, Gpu, GpuOptions, PassTimes, Spread, TimesAccumulator};
use crate::image::{Aov, GuideImage, Image};
use crate::metrics::Channel;
use crate::scene::Scene;
use crate::vulkan::DeviceKind;

use super::report::{DirectionCost, ErrorReport, MemoryRow, MotionTimes, ReferenceInfo, Report, Timing};
use super::stages::{StageTimes, When, part_ms, stage_times};

/// What is measured: one technique with all its settings.
#[derive(Clone)]
pub struct Case {
    /// The technique.
    pub entry: &'static Entry,
    /// The preset that the settings started from.
    pub preset: Option<String>,
    /// The settings.
    pub settings: Settings,
}

/// Every technique with each preset at each resolution, `pairs` on top of all. A technique without presets or without a setting `resolution` has one
/// case instead of several; no presets at all stand for each technique's default.
pub fn cases(techniques: &[&'static Entry], presets: &[String], resolutions: &[u32], pairs: &[String]) -> Result<Vec<Case>, SettingError> {
    let mut cases = Vec::new();
    for &entry in techniques {
        let default = entry.presets.first().map(|preset| preset.name.to_owned());
        let presets: Vec<Option<String>> = if presets.is_empty() || default.is_none() { vec![default] } else { presets.iter().cloned().map(Some).collect() };
        let has_resolution = entry.settings.iter().copied().flatten().any(|setting| setting.name == "resolution");
        let resolutions: Vec<Option<u32>> =
            if resolutions.is_empty() || !has_resolution { vec![None] } else { resolutions.iter().copied().map(Some).collect() };
        for preset in &presets {
            for resolution in &resolutions {
                let all: Vec<String> = resolution.iter().map(|resolution| format!("resolution={resolution}")).chain(pairs.iter().cloned()).collect();
                cases.push(Case { entry, preset: preset.clone(), settings: entry.settings(preset.as_deref(), &all)? });
            }
        }
    }
    Ok(cases)
}

/// How to measure.
#[derive(Clone, Debug)]
pub struct BenchSettings {
    /// Which device.
    pub device: DeviceChoice,
    /// Where times come from.
    pub timing: Timing,
    /// What all techniques share.
    pub frame: FrameSettings,
    /// Frames after the one that warms up.
    pub frames: u32,
    /// Builds after the first.
    pub rebuilds: u32,
    /// Times (s) at which dynamic models are put, so often as there are builds.
    pub times: Vec<f32>,
    /// What of a colour is compared.
    pub channel: Channel,
}

/// What a scene looks like, and what its indirect light ought to be.
#[derive(Clone, Debug)]
pub struct Truth {
    /// What each pixel sees.
    pub guide: GuideImage,
    /// The indirect radiance, and where it is from; `None` where no error is wanted.
    pub indirect: Option<(Image, ReferenceInfo)>,
}

/// How a device is best timed: by its timestamps, unless it runs on the CPU. Lavapipe's do not follow what it executes.
pub fn choose_timing(device: &DeviceChoice) -> Result<Timing, Error> {
    let gpu = Gpu::new(&GpuOptions { device: device.clone(), ..GpuOptions::default() })?;
    Ok(if gpu.info().kind == DeviceKind::Cpu { Timing::Host } else { Timing::Timestamps })
}

/// Measures one case on a device of its own, so that every first build compiles its pipelines. What the device refuses is told in
/// the report; an error is that there is no device.
pub fn measure(scene: &Scene, case: &Case, settings: &BenchSettings, truth: &Truth) -> Result<Report, Error> {
    let options = GpuOptions { device: settings.device.clone(), isolate_passes: settings.timing == Timing::Host, ..GpuOptions::default() };
    let gpu = Gpu::new(&options)?;
    let run = run(&gpu, scene, case, settings);
    let mut report = match &run {
        Ok(run) => run.report(&gpu, scene, case, settings, truth),
        Err(failure) => Report { failure: Some(failure.to_string()), refused: refused(failure), ..empty_report(&gpu, scene, case, settings) },
    };
    if let (Ok(run), Some((reference, info))) = (&run, &truth.indirect) {
        let error = ErrorReport::of(Aov::Indirect, [&run.indirect, reference], scene, &truth.guide, settings.channel);
        match error {
            Ok(error) => (report.error, report.reference) = (Some(error), Some(*info)),
            Err(source) => report.failure = Some(format!("{} cannot be compared with the reference: {source}", case.entry.name)),
        }
    }
    Ok(report)
}

/// What was too large, and its bytes.
fn refused(failure: &Error) -> Option<MemoryRow> {
    match failure {
        Error::TooLarge { resource, wanted, .. } | Error::OutOfMemory { resource, wanted, .. } => Some(MemoryRow { name: resource.clone(), bytes: *wanted }),
        _ => None,
    }
}

fn empty_report(gpu: &Gpu, scene: &Scene, case: &Case, settings: &BenchSettings) -> Report {
    Report {
        preset: case.preset.clone(),
        shadow_resolution: Some(settings.frame.shadow_resolution),
        ..Report::new(gpu, &scene.name, settings.frame.size, case.entry.name, &case.settings)
    }
}

/// What a case gave before it is summed up.
struct Run<'g> {
    first_build: FrameStats,
    builds: Vec<FrameStats>,
    frames: Vec<FrameStats>,
    motion: Vec<MotionTimes>,
    indirect: Image,
    counts: Vec<(&'static str, u64)>,
    /// Samples of cones, by pass.
    samples: Vec<(&'static str, u64)>,
    /// Alive until memory has been listed.
    _renderer: Renderer<'g>,
}

fn run<'g>(gpu: &'g Gpu, scene: &Scene, case: &Case, settings: &BenchSettings) -> Result<Run<'g>, Error> {
    let (mut renderer, first_build) = Renderer::new(gpu, scene, case.entry, &case.settings, settings.frame)?;
    let builds = (0..settings.rebuilds).map(|_| renderer.rebuild()).collect::<Result<_, _>>()?;
    (0..warm_up_frames(case)).try_for_each(|_| renderer.render(&scene.camera).map(drop))?;
    let frames = (0..settings.frames).map(|_| renderer.render(&scene.camera)).collect::<Result<_, _>>()?;
    let (indirect, counts) = (renderer.aov(Aov::Indirect)?, renderer.counts()?);
    let samples = renderer.count_samples()?;
    let motion = motion(&mut renderer, scene, settings)?;
    Ok(Run { first_build, builds, frames, motion, indirect, counts, samples, _renderer: renderer })
}

/// Puts the scene's models where they are at each time, several times; the first may have to make buffers larger and is not counted.
fn motion(renderer: &mut Renderer<'_>, scene: &Scene, settings: &BenchSettings) -> Result<Vec<MotionTimes>, Error> {
    let mut moved = scene.clone();
    let mut rows = Vec::new();
    for &time_s in &settings.times {
        moved.set_time(time_s);
        renderer.set_pose(&moved)?;
        let runs = (0..settings.rebuilds).map(|_| renderer.set_pose(&moved)).collect::<Result<Vec<FrameStats>, _>>()?;
        let Some(gpu_ms) = Spread::of(&runs.iter().map(FrameStats::total_ms).collect::<Vec<f64>>()) else { continue };
        let dynamic_voxels = renderer.counts()?.into_iter().find(|(name, _)| *name == "dynamic_voxels").map(|(_, count)| count);
        rows.push(MotionTimes { time_s, dynamic_voxels, gpu_ms, passes: self::rows(&runs) });
    }
    Ok(rows)
}

/// Frames before those that are measured: one, but where each frame adds a bounce so many that ¾ to this power, 1% of the light, is left.
pub(super) fn warm_up_frames(case: &Case) -> u32 {
    if (case.entry.bounces)(&case.settings).is_some() { 1 } else { 16 }
}

impl Run<'_> {
    fn report(&self, gpu: &Gpu, scene: &Scene, case: &Case, settings: &BenchSettings, truth: &Truth) -> Report {
        let passes = rows(&self.frames);
        let stages: Vec<StageTimes> =
            [(When::Build, &self.builds), (When::Frame, &self.frames)].into_iter().flat_map(|(when, runs)| stage_times(case.entry, when, runs)).collect();
        Report {
            counting: PassTimes::once(&self.first_build.counting),
            first_build: PassTimes::once(&self.first_build.passes),
            build: rows(&self.builds),
            directions: direction_costs(&passes, case, scene, &truth.guide, &self.samples),
            motion: self.motion.clone(),
            passes,
            totals: totals(&stages, &self.builds, &self.frames, case.entry),
            stages,
            counts: self.counts.iter().copied().collect(),
            ..empty_report(gpu, scene, case, settings)
        }
    }
}

fn rows(stats: &[FrameStats]) -> Vec<PassTimes> {
    let mut times = TimesAccumulator::default();
    stats.iter().for_each(|stats| times.add(&stats.passes));
    times.rows()
}

fn totals(stages: &[StageTimes], builds: &[FrameStats], frames: &[FrameStats], entry: &Entry) -> Vec<PassTimes> {
    let all = |name: &str, runs: &[FrameStats]| {
        let gpu_ms = Spread::of(&runs.iter().map(FrameStats::total_ms).collect::<Vec<f64>>()).filter(|_| runs.iter().any(|run| !run.passes.is_empty()))?;
        Some(PassTimes { name: name.to_owned(), gpu_ms })
    };
    let part = |name: &str, part: Part| {
        let ran = stages.iter().any(|stage| stage.part == Some(part) && stage.when == When::Frame);
        let gpu_ms = Spread::of(&frames.iter().map(|frame| part_ms(entry, frame, part)).collect::<Vec<f64>>()).filter(|_| ran)?;
        Some(PassTimes { name: name.to_owned(), gpu_ms })
    };
    let totals = [all("build", builds), part("update", Part::Store), part("gather", Part::Picture), part("shared", Part::Shared), all("frame", frames)];
    totals.into_iter().flatten().collect()
}

fn directions_of(entry: &Entry, pass: &str) -> Option<&'static Directions> {
    entry.directions.iter().find(|directions| directions.pass.name == pass)
}

fn direction_costs(passes: &[PassTimes], case: &Case, scene: &Scene, guide: &GuideImage, samples: &[(&str, u64)]) -> Vec<DirectionCost> {
    let surfaces: Vec<usize> = (0..guide.material.len()).filter(|&index| guide.is_surface(index)).collect();
    let is_glossy = |index: &&usize| scene.materials.get(guide.material[**index] as usize).is_some_and(|material| material.specular.is_some());
    let cost = |pass: &PassTimes| {
        let (directions, pixels) = match directions_of(case.entry, &pass.name)?.setting {
            Some(setting) => (count(&case.settings, setting)?, surfaces.len()),
            None => (1, surfaces.iter().filter(is_glossy).count()),
        };
        let us = pass.gpu_ms.median * 1e3;
        let samples = samples.iter().find(|(name, _)| *name == pass.name).map(|(_, samples)| *samples).filter(|samples| *samples > 0);
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

/// A whole-number setting; `None` where the technique has none of this name.
pub(super) fn count(settings: &Settings, name: &str) -> Option<u32> {
    settings.iter().find_map(|(key, value)| match value {
        Value::Count(count) if key == name => Some(count),
        _ => None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gi::registry::{TECHNIQUES, find};
    use crate::graph::PassTime;

    fn stats(passes: &[(&str, f64)]) -> FrameStats {
        let pass = |(name, gpu_ms): &(&str, f64)| PassTime { name: (*name).to_owned(), gpu_ms: *gpu_ms, runs: 1 };
        FrameStats { passes: passes.iter().map(pass).collect(), ..FrameStats::default() }
    }

    #[test]
    fn totals_add_the_parts() -> Result<(), Box<dyn std::error::Error>> {
        let builds = [stats(&[("voxel.clear", 1.0), ("voxel.fragments", 4.0), ("voxel_mips.clear", 7.0)])];
        let frames = [stats(&[("voxel.light", 1.0), ("voxel_mips.filter", 2.0), ("cone.gather", 8.0)]), stats(&[("cone.gather", 10.0)])];
        let entry = find("voxel-mips")?;
        let totals = totals(&stage_times(entry, When::Frame, &frames), &builds, &frames, entry);
        let median = |name: &str| totals.iter().find(|total| total.name == name).map(|total| total.gpu_ms.median);
        assert_eq!(["build", "update", "gather", "shared", "frame"].map(median), [Some(12.0), Some(1.5), Some(9.0), None, Some(10.5)]);
        Ok(())
    }

    #[test]
    fn directions_are_of_a_techniques_own_passes_and_settings() {
        for entry in TECHNIQUES {
            for directions in entry.directions {
                assert!(entry.passes.iter().copied().flatten().any(|pass| std::ptr::eq(*pass, directions.pass)), "{}", directions.pass.name);
                let settings = entry.settings::<&str>(None, &[]);
                assert!(directions.setting.is_none_or(|name| settings.is_ok_and(|settings| count(&settings, name).is_some())), "{:?}", directions.setting);
            }
        }
    }

    #[test]
    fn every_technique_has_a_default_case() {
        assert!(cases(TECHNIQUES, &[], &[], &[]).is_ok_and(|cases| cases.len() == TECHNIQUES.len()));
    }

    #[test]
    fn cases_are_the_product() -> Result<(), Box<dyn std::error::Error>> {
        let presets = ["cones".to_owned(), "textbook".to_owned()];
        let all = cases(&[find("voxel-mips")?, find("none")?], &presets, &[16, 32, 64], &[])?;
        assert_eq!(all.len(), 7);
        assert_eq!(count(&all[4].settings, "resolution"), Some(32));
        assert_eq!(all[4].preset.as_deref(), Some("textbook"));
        Ok(())
    }
}
