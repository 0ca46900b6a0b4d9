//! `lumivox render`: one picture by one technique.

use std::path::{Path, PathBuf};

use crate::frame::Renderer;
use crate::gi::entry::Entry;
use crate::gi::inspect::ViewRow;
use crate::gi::settings::Settings;
use crate::graph::{Error, FrameStats, Gpu, GpuOptions, PassTimes, TimesAccumulator};
use crate::image::{Aov, GuideImage, Image, read_aov};
use crate::measure::chart::{BounceSetting, bounces_text};
use crate::measure::report::{EnergyRow, ErrorReport, Report, Timing, shadow_changes};
use crate::metrics::{Channel, Errors};
use crate::reference::{Bounces, guide};
use crate::render::GpuScene;
use crate::scene::Scene;
use crate::text::short;

use super::CliError;
use super::capture::Capture;
use super::common::{DeviceArgs, SceneArgs, TechniqueArgs, TimingArgs, say, while_shown};
use super::files::Files;
use super::frame::FrameArgs;
use super::picture::PictureArgs;
use super::sequence::SequenceArgs;
use super::suited::{Chosen, Suiting};

/// Render a scene with one technique.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n\
\x20 lumivox render bundled:cornell -o cornell.png\n\
\x20 lumivox render room.obj --technique svo --set resolution=256 -o room.exr\n\
\x20 lumivox render bundled:cornell --set history=32 --frames 30 --pan 1 -o pan_####.exr")]
pub(crate) struct Args {
    /// The reference's image of the same output and of the last frame, or all outputs as
    /// `reference --layers` writes them: the report gets the error against it.
    #[arg(long, value_name = "FILE.exr")]
    reference: Option<PathBuf>,
    /// Instead of the picture, write a view of the technique's own data, as the camera sees it;
    /// `lumivox techniques NAME` lists them.
    #[arg(
        long,
        alias = "voxels",
        value_name = "VIEW",
        conflicts_with_all = ["reference", "aov"],
    )]
    view: Option<String>,
    /// Level that the view shows, 0 the finest.
    #[arg(
        long,
        alias = "voxel-level",
        value_name = "N",
        default_value_t = 0,
        requires = "view"
    )]
    level: u32,
    /// Run with the Vulkan validation layer and synchronization validation; any message is a
    /// failure.
    #[arg(long)]
    validate: bool,
    /// Let RenderDoc capture the last frame. It has to be installed.
    #[arg(long, value_name = "FILE.rdc")]
    capture: Option<PathBuf>,
    /// Print every barrier of every frame, with the two passes and the hazard that it is for.
    #[arg(long)]
    trace_barriers: bool,
    #[command(flatten)]
    scene: SceneArgs,
    #[command(flatten)]
    technique: TechniqueArgs,
    #[command(flatten)]
    picture: PictureArgs,
    #[command(flatten)]
    frame: FrameArgs,
    #[command(flatten)]
    device: DeviceArgs,
    #[command(flatten)]
    sequence: SequenceArgs,
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
            captures: self.capture.is_some(),
            trace_barriers: self.trace_barriers,
            isolate_passes,
            ..options
        })
        .map_err(|error| match error {
            Error::DeviceRefused { .. } if self.capture.is_some() => CliError::failed(format!(
                "{error}; RenderDoc hides Vulkan 1.3 of devices that lack \
                 bufferDeviceAddressCaptureReplay, so that --capture does not work with them"
            )),
            error => CliError::failed(error),
        })
    }
}

/// Loads, renders, writes.
pub(crate) fn run(args: &Args, quiet: bool) -> Result<(), CliError> {
    let mut files = Files::default();
    args.picture.check(&mut files, args.sequence.frames)?;
    args.sequence.check()?;
    args.capture
        .iter()
        .try_for_each(|path| files.write(path, &["rdc"]))?;
    args.reference
        .iter()
        .try_for_each(|path| files.read(path))?;
    let (entry, settings) = args.technique.choose([])?;
    let mut scene = args.scene.open(&mut files)?;
    let shot = args.sequence.path.shot(&scene, args.scene.time_s());
    let last = args.sequence.frames - 1;
    let truth = args
        .reference
        .as_ref()
        .map(|path| {
            let mut scene = scene.clone();
            shot.place(&mut scene, last);
            ReferenceFile::read(path, &scene, &args.picture)
        })
        .transpose()?;
    let gpu = args.gpu()?;
    let mut capture = args.capture.as_deref().map(Capture::new).transpose()?;
    let size = args.picture.size.into();
    let gpu_scene = GpuScene::new(&gpu, &scene).map_err(CliError::failed)?;
    let Chosen {
        settings,
        frame,
        suited,
    } = Suiting {
        technique: &args.technique,
        frame: &args.frame,
        size,
        quiet,
    }
    .of((entry, settings), &gpu, (&gpu_scene, &scene))?;
    let (mut renderer, build) = while_shown(quiet, format!("building {}", entry.name), || {
        Renderer::of(&gpu, gpu_scene, entry, &settings, frame)
    })
    .map_err(CliError::failed)?;
    let view = args
        .view
        .as_ref()
        .map(|name| choose_view(entry, &renderer, name, args.level))
        .transpose()?;
    let is_light = view.is_none() && args.picture.aov.is_light();
    let mut times = TimesAccumulator::default();
    let mut image = Image::new(0, 0);
    for frame in 0..args.sequence.frames {
        let moves = frame > 0 && shot.place(&mut scene, frame);
        let mut stats = match moves {
            true => renderer.set_pose(&scene).map_err(CliError::failed)?,
            false => FrameStats::default(),
        };
        let mut draw = || renderer.render(&scene.camera).map_err(CliError::failed);
        stats.append(match capture.take_if(|_| frame == last) {
            Some(capture) => capture.take(draw)?,
            None => draw()?,
        });
        if frame > 0 || args.sequence.frames == 1 {
            times.add(&stats.passes);
        }
        if frame == last || args.picture.has_numbers() {
            image = match view {
                Some(view) => renderer
                    .view(view, args.level)
                    .map_err(CliError::failed)?
                    .ok_or_else(|| {
                        CliError::failed("the technique has dropped what the view shows")
                    })?,
                None => renderer.aov(args.picture.aov).map_err(CliError::failed)?,
            };
            args.picture
                .write(frame, &image, (&args.scene, &scene), is_light)?;
        }
    }
    if view.is_none() && args.picture.aov == Aov::Full {
        args.picture
            .warn_of_nothing(last, &image, (&args.scene, &scene));
    }
    let mut report = Report::new(&gpu, &scene.name, size, entry.name, &settings);
    report.preset = args.technique.preset(entry);
    report.suited = suited;
    report.time_s = args.scene.time_s();
    report.sequence = args.sequence.row(&shot);
    report.voxel_size_m = renderer.cell_size();
    report.counting = PassTimes::once(&build.counting);
    report.build = PassTimes::once(&build.passes);
    report.passes = times.rows();
    report.shadows = shadow_changes(&frame.shadows);
    report.set_counts(&renderer.counts_of_report().map_err(CliError::failed)?);
    if args.picture.report.is_some() {
        report.set_energy(renderer.energy().map_err(CliError::failed)?);
    }
    if let (Some(ReferenceFile { reference, guide }), Some(path)) = (&truth, &args.reference) {
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
        if args.reference.is_some() {
            left_out(entry, &settings).iter().for_each(|line| say(line));
        }
    }
    Ok(())
}

/// What the technique does not compute, so that a reference with other bounces is not mistaken for
/// its error; a file of the reference does not say how many it has.
fn left_out(entry: &Entry, settings: &Settings) -> Option<String> {
    let count = (entry.bounces)(settings)?;
    let more = BounceSetting::of(entry, settings)
        .map(|setting| {
            let values = setting.values.join(", ");
            format!("; --set {}=… adds more: {values}", setting.name)
        })
        .unwrap_or_default();
    Some(format!(
        "{} computes {} of indirect light and leaves the others out, as does `lumivox reference \
         --bounces {count}`{more}",
        entry.name,
        bounces_text(Bounces::Count(count))
    ))
}

/// The view of a name, where the technique has it, and this level of it.
fn choose_view(
    entry: &Entry,
    renderer: &Renderer<'_>,
    name: &str,
    level: u32,
) -> Result<&'static ViewRow, CliError> {
    let technique = entry.name;
    let Some(view) = entry.view(name) else {
        let mut known = entry.views.iter().copied().flatten().map(|view| view.name);
        let first = known.next().ok_or_else(|| {
            CliError::input(format!("--view {name}: {technique} has no views of itself"))
        })?;
        let known = known.fold(first.to_owned(), |list, name| list + ", " + name);
        return Err(CliError::input(format!(
            "--view {name}: the views of {technique} are {known}"
        )));
    };
    let presets: Vec<&str> = entry.presets.iter().map(|preset| preset.name).collect();
    match renderer.levels(view) {
        0 => Err(CliError::input(format!(
            "--view {name}: with these settings {technique} does not keep what it shows ({}); \
             name another preset: {}",
            view.help,
            presets.join(", ")
        ))),
        levels if level >= levels => Err(CliError::input(format!(
            "--level {level}: the levels are 0 to {}",
            levels - 1
        ))),
        _ => Ok(view),
    }
}

/// What the image ought to be, and what each of its pixels sees.
struct ReferenceFile {
    reference: Image,
    guide: GuideImage,
}

impl ReferenceFile {
    fn read(path: &Path, scene: &Scene, picture: &PictureArgs) -> Result<ReferenceFile, CliError> {
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
        Ok(ReferenceFile {
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
    for EnergyRow { name, watts } in &report.energy {
        let [red, green, blue] = watts.map(short);
        say(&format!("  {name:<28} {red} {green} {blue} W"));
    }
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
