//! `lumivox render`: one picture by one technique.

use std::path::{Path, PathBuf};

use lumivox::frame::{FrameSettings, Renderer};
use lumivox::graph::{Gpu, GpuOptions, PassTimes, TimesAccumulator};
use lumivox::image::{GuideImage, Image, read_aov};
use lumivox::measure::report::{ErrorReport, Report, Timing};
use lumivox::metrics::{Channel, Errors};
use lumivox::reference::guide;
use lumivox::scene::Scene;

use super::CliError;
use super::common::{
    DeviceArgs, PictureArgs, SceneArgs, ShadowArgs, TechniqueArgs, TimingArgs, say,
};

/// Render a scene with one technique.
#[derive(clap::Args)]
pub(crate) struct Args {
    #[command(flatten)]
    scene: SceneArgs,
    #[command(flatten)]
    technique: TechniqueArgs,
    #[command(flatten)]
    picture: PictureArgs,
    #[command(flatten)]
    shadow: ShadowArgs,
    #[command(flatten)]
    device: DeviceArgs,
    /// Frames to render; times are the medians over all but the first.
    #[arg(
        long,
        value_name = "N",
        default_value_t = 1,
        value_parser = clap::value_parser!(u32).range(1..=100_000),
    )]
    frames: u32,
    /// The reference's image of the same output, or all outputs as `reference --layers` writes
    /// them: the report gets the error against it.
    #[arg(long, value_name = "FILE.exr")]
    reference: Option<PathBuf>,
    /// In place of the picture, the technique's voxels as the camera sees them: light (radiance),
    /// opacity, structure (how space is divided), or, with bricks of them, albedo, normal,
    /// emission.
    #[arg(long, value_name = "WHAT", conflicts_with_all = ["reference", "aov"])]
    voxels: Option<String>,
    /// Which level of them, 0 the finest.
    #[arg(long, value_name = "N", default_value_t = 0, requires = "voxels")]
    voxel_level: u32,
    /// Run with the Vulkan validation layer and synchronization validation; any message is a
    /// failure.
    #[arg(long)]
    validate: bool,
    /// Print every barrier of every frame, with the two passes and the hazard that it is for.
    #[arg(long)]
    trace_barriers: bool,
    #[command(flatten)]
    timing: TimingArgs,
}

impl Args {
    fn gpu(&self) -> Result<Gpu, CliError> {
        let options = self.device.options()?;
        let isolate_passes = self.timing.choice(&options)? == Timing::Host;
        let validate = options.validate || self.validate;
        Gpu::new(&GpuOptions {
            validate,
            trace_barriers: self.trace_barriers,
            isolate_passes,
            ..options
        })
        .map_err(CliError::failed)
    }
}

/// Loads, renders, writes.
pub(crate) fn run(args: &Args, quiet: bool) -> Result<(), CliError> {
    args.picture.check()?;
    let (entry, settings) = args.technique.choose([])?;
    let scene = args.scene.open()?;
    let truth = args
        .reference
        .as_ref()
        .map(|path| Truth::read(path, &scene, &args.picture))
        .transpose()?;
    let gpu = args.gpu()?;
    let size = args.picture.size.into();
    let frame = FrameSettings {
        size,
        shadow_resolution: args.shadow.shadow_resolution,
    };
    let (mut renderer, build) =
        Renderer::new(&gpu, &scene, entry, &settings, frame).map_err(CliError::failed)?;
    let view = args
        .voxels
        .as_ref()
        .map(|what| VoxelView::choose(what, args.voxel_level, &renderer.volumes()))
        .transpose()?;
    let mut times = TimesAccumulator::default();
    for index in 0..args.frames {
        let stats = renderer.render(&scene.camera).map_err(CliError::failed)?;
        if index > 0 || args.frames == 1 {
            times.add(&stats.passes);
        }
    }
    let image = match &view {
        Some(view) => view.image(&renderer)?,
        None => renderer.aov(args.picture.aov).map_err(CliError::failed)?,
    };
    args.picture.write(&image)?;
    let mut report = Report::new(&gpu, &scene.name, size, entry.name, &settings);
    report.preset = args.technique.preset(entry);
    report.time_s = args.scene.time_s();
    report.voxel_size_m = renderer.voxel_size();
    report.counting = PassTimes::once(&build.counting);
    report.build = PassTimes::once(&build.passes);
    report.passes = times.rows();
    report.set_counts(&renderer.counts().map_err(CliError::failed)?);
    if let (Some(Truth { reference, guide }), Some(path)) = (&truth, &args.reference) {
        let error = ErrorReport::of(
            args.picture.aov,
            [&image, reference],
            &scene,
            guide,
            Channel::Luminance,
        )
        .map_err(CliError::failed)?;
        report.error = Some(error);
        report.reference_file = Some(path.to_string_lossy().into_owned());
    }
    if let Some(path) = &args.picture.report {
        report.write(path).map_err(CliError::failed)?;
    }
    if !quiet {
        print_report(&report);
    }
    Ok(())
}

/// What of the technique's voxels is to be seen.
struct VoxelView<'a> {
    volume: &'a str,
    aspect: Aspect,
    level: u32,
}

#[derive(Clone, Copy)]
enum Aspect {
    Value,
    Opacity,
    Structure,
}

impl<'a> VoxelView<'a> {
    fn choose(
        what: &'a str,
        level: u32,
        volumes: &[(&'static str, u32)],
    ) -> Result<Self, CliError> {
        let (volume, aspect) = match what {
            "opacity" => ("light", Aspect::Opacity),
            "structure" => ("light", Aspect::Structure),
            _ => (what, Aspect::Value),
        };
        match volumes.iter().find(|(name, _)| *name == volume) {
            Some((_, levels)) if level < *levels => Ok(VoxelView {
                volume,
                aspect,
                level,
            }),
            Some((_, levels)) => Err(CliError::input(format!(
                "--voxel-level {level}: the levels are 0 to {}",
                levels - 1
            ))),
            None if volumes.is_empty() => Err(CliError::input(
                "--voxels: with these settings the technique keeps no volume; try --preset cones"
                    .to_owned(),
            )),
            None => {
                let known: Vec<&str> = volumes
                    .iter()
                    .map(|(name, _)| *name)
                    .chain(["opacity", "structure"])
                    .collect();
                Err(CliError::input(format!(
                    "--voxels {what}: known here are {}; svo with --set attributes=on keeps \
                     albedo, normal and emission",
                    known.join(", ")
                )))
            }
        }
    }

    fn image(&self, renderer: &Renderer<'_>) -> Result<Image, CliError> {
        let dropped = || CliError::failed("the technique has dropped its volume");
        if let Aspect::Structure = self.aspect {
            return renderer
                .view_structure(self.level)
                .map_err(CliError::failed)?
                .ok_or_else(dropped);
        }
        let [value, opacity] = renderer
            .view_voxels(self.volume, self.level)
            .map_err(CliError::failed)?
            .ok_or_else(dropped)?;
        Ok(if let Aspect::Opacity = self.aspect {
            opacity
        } else {
            value
        })
    }
}

/// What the image ought to be, and what each of its pixels sees.
struct Truth {
    reference: Image,
    guide: GuideImage,
}

impl Truth {
    fn read(path: &Path, scene: &Scene, picture: &PictureArgs) -> Result<Truth, CliError> {
        let reference = read_aov(path, picture.aov).map_err(CliError::input)?;
        let ((width, height), (wanted_width, wanted_height)) = (reference.size(), picture.size);
        if reference.size() != picture.size {
            let problem = format!(
                "the reference {} is {width}x{height}, the image {wanted_width}x{wanted_height}",
                path.display()
            );
            return Err(CliError::input(format!(
                "{problem}; render it with --size {width}x{height}"
            )));
        }
        if !reference.pixels.iter().all(|pixel| pixel.is_finite()) {
            return Err(CliError::input(format!(
                "the reference {} has pixels that are not finite; render it again",
                path.display()
            )));
        }
        Ok(Truth {
            reference,
            guide: guide(scene, width, height).map_err(CliError::input)?,
        })
    }
}

/// Prints passes, memory, counts and error.
fn print_report(report: &Report) {
    let row = |pass: &PassTimes| {
        say(&format!(
            "  {:<28} {:>10.3} ms",
            pass.name, pass.gpu_ms.median
        ))
    };
    let total = |passes: &[PassTimes]| passes.iter().map(|pass| pass.gpu_ms.median).sum::<f64>();
    say(&format!("{} on {}", report.technique, report.device));
    for (title, passes) in [
        ("counting, before the first build", &report.counting),
        ("build", &report.build),
        ("frame", &report.passes),
    ] {
        if passes.is_empty() {
            continue;
        }
        say(title);
        passes.iter().for_each(row);
        say(&format!("  {:<28} {:>10.3} ms", "total", total(passes)));
    }
    say(&format!(
        "memory {:.1} MiB",
        report.memory_bytes as f64 / f64::from(1 << 20)
    ));
    report
        .counts
        .iter()
        .for_each(|(name, count)| say(&format!("  {name:<28} {count:>10}")));
    if let Some(error) = &report.error {
        let row = |of: &str, errors: &Errors| {
            say(&format!(
                "error of {}, {of}: bias {:+.4}, rel_rmse {:.4}",
                error.aov, errors.bias, errors.rel_rmse
            ))
        };
        row("pixels", &error.pixel);
        error.block.iter().for_each(|block| row("blocks", block));
        say(&format!(
            "error of {}, flip: mean {:.4}",
            error.aov, error.flip.mean
        ));
    }
}
