//! `lumivox render`: one picture by one technique.

use std::ffi::OsString;
use std::path::PathBuf;

use lumivox::frame::{FrameSettings, Renderer};
use lumivox::gi::registry::find;
use lumivox::graph::{DeviceChoice, Gpu, GpuOptions, PassTimes, TimesAccumulator};
use lumivox::image::{Aov, write_exr, write_png};
use lumivox::measure::report::Report;
use lumivox::scene::{LoadOptions, Scene};

use super::CliError;
use super::common::{is_exr, parse_size, say};

/// Render a scene with one technique.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// `bundled:NAME`, or the path of a .toml or .obj file.
    scene: OsString,
    #[command(flatten)]
    pub(super) technique: TechniqueArgs,
    /// What to write: full, direct, indirect, diffuse, specular, visibility, emission, albedo, normal, depth.
    #[arg(long, default_value = "full")]
    aov: Aov,
    /// The image: .exr (linear, 32-bit float) or .png (sRGB).
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// Factor applied before the clamp of a .png.
    #[arg(long, value_name = "X", default_value_t = 1.0)]
    exposure: f32,
    /// Write times, memory and counts as JSON.
    #[arg(long, value_name = "FILE.json")]
    report: Option<PathBuf>,
    /// Frames to render; times are the medians over all but the first.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    frames: u32,
    /// Render missing textures mid-grey instead of failing.
    #[arg(long)]
    allow_missing_textures: bool,
}

/// Which technique, on which device.
#[derive(clap::Args)]
pub(crate) struct TechniqueArgs {
    /// Technique; `lumivox techniques` lists them.
    #[arg(long, default_value = "voxel-mips")]
    technique: String,
    /// Preset of the technique.
    #[arg(long)]
    preset: Option<String>,
    /// One setting of the technique, on top of the preset; may be repeated.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Width and height (px).
    #[arg(long, value_name = "WxH", default_value = "1280x720", value_parser = parse_size)]
    size: (u32, u32),
    /// Width and height of each shadow map and reflective shadow map (texels).
    #[arg(long, value_name = "N", default_value_t = 1024, value_parser = clap::value_parser!(u32).range(16..=8192))]
    shadow_resolution: u32,
    /// Device, by index or part of its name; `lumivox devices` lists them.
    #[arg(long, value_name = "INDEX|NAME")]
    device: Option<String>,
    /// Run with the Vulkan validation layer and synchronization validation; any message is a failure.
    #[arg(long)]
    validate: bool,
    /// Print every barrier of every frame, with the two passes and the hazard that it is for.
    #[arg(long)]
    trace_barriers: bool,
    /// Submit every pass by itself and time it on the host: for software drivers, whose timestamps charge one pass with another's work.
    #[arg(long)]
    isolate_passes: bool,
}

impl TechniqueArgs {
    /// Opens the device.
    pub(super) fn gpu(&self) -> Result<Gpu, CliError> {
        let device = self.device.as_deref().map(DeviceChoice::from).unwrap_or_default();
        Gpu::new(&GpuOptions { device, validate: self.validate, trace_barriers: self.trace_barriers, isolate_passes: self.isolate_passes })
            .map_err(CliError::failed)
    }
}

/// Loads, renders, writes.
pub(crate) fn run(args: &Args, quiet: bool) -> Result<(), CliError> {
    let is_exr = is_exr(&args.output)?;
    if !(args.exposure.is_finite() && args.exposure > 0.0) {
        return Err(CliError::input(format!("--exposure is {}; it must be above 0", args.exposure)));
    }
    let choice = &args.technique;
    let entry = find(&choice.technique).map_err(CliError::input)?;
    let settings = entry.settings(choice.preset.as_deref(), &choice.set).map_err(CliError::input)?;
    let scene = Scene::open(&args.scene, &LoadOptions { allow_missing_textures: args.allow_missing_textures }).map_err(CliError::input)?;
    let gpu = choice.gpu()?;
    let size = [choice.size.0, choice.size.1];
    let frame = FrameSettings { size, shadow_resolution: choice.shadow_resolution };
    let (mut renderer, build) = Renderer::new(&gpu, &scene, entry, &settings, frame).map_err(CliError::failed)?;
    let mut times = TimesAccumulator::default();
    for index in 0..args.frames {
        let stats = renderer.render(&scene.camera).map_err(CliError::failed)?;
        if index > 0 || args.frames == 1 {
            times.add(&stats);
        }
    }
    let image = renderer.aov(args.aov).map_err(CliError::failed)?;
    if is_exr { write_exr(&args.output, &image) } else { write_png(&args.output, &image, args.exposure) }.map_err(CliError::failed)?;
    let mut report = Report::new(&gpu, &scene.name, size, entry.name, &settings);
    report.preset = choice.preset.clone().or_else(|| entry.presets.first().map(|preset| preset.name.to_owned()));
    let mut build_times = TimesAccumulator::default();
    build_times.add(&build);
    report.build = build_times.rows();
    report.passes = times.rows();
    report.counts = renderer.counts().map_err(CliError::failed)?.into_iter().collect();
    if let Some(path) = &args.report {
        report.write(path).map_err(CliError::failed)?;
    }
    if !quiet {
        print_report(&report);
    }
    drop(renderer);
    let messages = gpu.messages();
    drop(gpu);
    match messages.list().as_slice() {
        [] => Ok(()),
        [first, ..] => Err(CliError::failed(format!("{} validation messages, the first: {first}", messages.list().len()))),
    }
}

/// Prints passes, memory and counts.
pub(super) fn print_report(report: &Report) {
    let row = |pass: &PassTimes| say(&format!("  {:<28} {:>10.3} ms", pass.name, pass.gpu_ms.median));
    let total = |passes: &[PassTimes]| passes.iter().map(|pass| pass.gpu_ms.median).sum::<f64>();
    say(&format!("{} on {}", report.technique, report.device));
    say("build");
    report.build.iter().for_each(row);
    say(&format!("  {:<28} {:>10.3} ms", "total", total(&report.build)));
    say("frame");
    report.passes.iter().for_each(row);
    say(&format!("  {:<28} {:>10.3} ms", "total", total(&report.passes)));
    say(&format!("memory {:.1} MiB", report.memory_bytes as f64 / f64::from(1 << 20)));
    report.counts.iter().for_each(|(name, count)| say(&format!("  {name:<28} {count:>10}")));
}
