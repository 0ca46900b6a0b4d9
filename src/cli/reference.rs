//! `lumivox reference`: renders the path-traced reference.

use std::time::Instant;

use crate::image::{Aov, write_planes};
use crate::reference::{
    Bounces, Filter, Radiosity, RadiositySettings, Sampling, Settings, cache_dir, cached, render,
    render_radiosity,
};
use crate::scene::{Scene, Shot};
use indicatif::{ProgressBar, ProgressStyle};

use super::CliError;
use super::common::{SceneArgs, say};
use super::compared::OcclusionArgs;
use super::files::Files;
use super::picture::PictureArgs;
use super::sequence::SequenceArgs;
use super::write::write_report;

/// Render the reference of a scene on the CPU: by path tracing, or for diffuse scenes by radiosity.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n\
\x20 lumivox reference bundled:cornell --bounces full -o reference.exr\n\
\x20 lumivox reference bundled:cornell --spp 64 --aov indirect -o indirect.png\n\
\x20 lumivox reference bundled:cornell --spp 64 --frames 30 --pan 1 -o r_####.exr\n\
\x20 lumivox reference bundled:cornell --method radiosity --spp 64 -o radiosity.exr")]
pub(crate) struct Args {
    /// How light gets to what the camera sees: by paths, or by patches that exchange it, in scenes
    /// without specular lobes (never from the cache).
    #[arg(long, value_enum, default_value_t = Method::Path)]
    method: Method,
    /// Rays from a side of an undivided patch of radiosity (a power of two).
    #[arg(long, value_name = "N", default_value_t = RadiositySettings::default().rays)]
    patch_rays: u32,
    /// Split a patch while its quarters would change the picture's mean indirect light by more than
    /// this share.
    #[arg(long, value_name = "X", default_value_t = RadiositySettings::default().max_error)]
    patch_error: f32,
    /// Make at most this many patches.
    #[arg(long, value_name = "N", default_value_t = RadiositySettings::default().max_patches)]
    max_patches: u32,
    /// Indirect bounces: a number (0 is direct light only), or `full` for all.
    #[arg(long, value_name = "N|full", default_value = "full", value_parser = parse_bounces)]
    bounces: Bounces,
    /// Write every output as a layer of one EXR, with `full` as R, G, B.
    #[arg(long, conflicts_with = "aov")]
    layers: bool,
    /// Sample until the standard error of 8x8-pixel means is below this, relative to the mean.
    #[arg(long, value_name = "X", default_value_t = 0.01)]
    max_error: f64,
    /// Take at most this many samples per pixel.
    #[arg(long, value_name = "N", default_value_t = 4096)]
    max_spp: u32,
    /// Take exactly this many samples per pixel (rounded up to whole batches), whatever the error.
    #[arg(long, value_name = "N", conflicts_with_all = ["max_error", "max_spp"])]
    spp: Option<u32>,
    /// Look at pixel centres (as a G-buffer does), or average over the pixel's square.
    #[arg(long, value_name = "center|box", default_value = "center", value_parser = parse_filter)]
    filter: Filter,
    /// Seed of the random numbers.
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,
    /// Render even where the cache has the result, and keep nothing.
    #[arg(long)]
    no_cache: bool,
    #[command(flatten)]
    occlusion: OcclusionArgs,
    #[command(flatten)]
    scene: SceneArgs,
    #[command(flatten)]
    picture: PictureArgs,
    #[command(flatten)]
    sequence: SequenceArgs,
}

/// How a reference is made.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Method {
    Path,
    Radiosity,
}

impl Method {
    fn name(self) -> &'static str {
        match self {
            Method::Path => "path",
            Method::Radiosity => "radiosity",
        }
    }
}

/// Loads, renders or finds in the cache, writes.
pub(crate) fn run(args: &Args, quiet: bool) -> Result<(), CliError> {
    let picture = &args.picture;
    let mut files = Files::default();
    picture.check(&mut files, args.sequence.frames)?;
    args.sequence.check()?;
    if args.sequence.frames > 1 && !picture.has_numbers() {
        return Err(CliError::input(format!(
            "--frames is {}, and {} has no number; write # for it, as in frame_####.exr",
            args.sequence.frames,
            picture.output.display()
        )));
    }
    if args.layers && !picture.is_exr() {
        return Err(CliError::input(format!(
            "--layers needs an .exr, not {}",
            picture.output.display()
        )));
    }
    if picture.aov == Aov::Discontinuity {
        return Err(no_such_aov(picture.aov));
    }
    let mut scene = args.scene.open(&mut files)?;
    let shot = args.sequence.path.shot(&scene, args.scene.time_s());
    let mut frames = Vec::new();
    for frame in 0..args.sequence.frames {
        shot.place(&mut scene, frame);
        frames.push(draw(args, &scene, frame, quiet)?);
    }
    let mut report = report(args, &scene, &shot);
    match frames.as_slice() {
        [only] if !picture.has_numbers() => only
            .iter()
            .for_each(|(key, value)| report[key] = value.clone()),
        _ => report["frames"] = frames.into(),
    }
    picture
        .report
        .as_ref()
        .map_or(Ok(()), |path| write_report(path, &report))
}

/// What a report says of one frame.
type FrameReport = serde_json::Map<String, serde_json::Value>;

/// Renders a frame or finds it in the cache, and writes it.
fn draw(args: &Args, scene: &Scene, frame: u32, quiet: bool) -> Result<FrameReport, CliError> {
    let (picture, settings) = (&args.picture, settings(args)?);
    let start = Instant::now();
    let bar = progress_bar(quiet);
    let progress = |share: f32| bar.set_position((share * 1000.0) as u64);
    let (image, radiosity) = match (args.method, args.no_cache) {
        (Method::Radiosity, _) => {
            render_radiosity(scene, &settings, &patch_settings(args), &progress)
                .map(|(image, solved)| (image, Some(solved)))
        }
        (Method::Path, true) => render(scene, &settings, &progress).map(|image| (image, None)),
        (Method::Path, false) => {
            cached(scene, &settings, &cache_dir(), &progress).map(|image| (image, None))
        }
    }
    .map_err(CliError::input)?;
    bar.finish_and_clear();
    let wall_s = start.elapsed().as_secs_f64();
    let path = picture.path(frame);
    if args.layers {
        write_planes(&path, &image.aov_planes()).map_err(CliError::failed)?;
    } else {
        let pixels = image
            .aov(picture.aov)
            .ok_or_else(|| no_such_aov(picture.aov))?;
        if picture.aov == Aov::Full {
            picture.warn_of_nothing(frame, &pixels, (&args.scene, scene));
        }
        let is_light = picture.aov.is_light();
        picture.write(frame, &pixels, (&args.scene, scene), is_light)?;
    }
    let error = image.radiance_error();
    if !quiet {
        let (path, samples) = (path.display(), image.mean_samples());
        let noise = if error.pixel.is_finite() {
            format!(
                "standard error {:.2}% per pixel, {:.4}% of the image mean",
                error.pixel * 100.0,
                error.image * 100.0
            )
        } else {
            "standard error unknown: more samples are needed to measure it".to_owned()
        };
        let patches = radiosity.as_ref().map_or(String::new(), |solved| {
            format!(
                ", {} patches, {} rays between them",
                solved.patch_count(),
                solved.ray_count()
            )
        });
        say(&format!(
            "{path}: {samples:.0} samples per pixel, {noise}{patches}, {wall_s:.1} s"
        ));
    }
    let errors = serde_json::json!({ "full": error, "indirect": image.indirect_error() });
    Ok(FrameReport::from_iter([
        ("samples_per_pixel".to_owned(), image.mean_samples().into()),
        ("standard_error".to_owned(), errors),
        ("wall_s".to_owned(), wall_s.into()),
        (
            "patches".to_owned(),
            radiosity.as_ref().map(Radiosity::patch_count).into(),
        ),
        (
            "patch_rays".to_owned(),
            radiosity.as_ref().map(Radiosity::ray_count).into(),
        ),
    ]))
}

fn no_such_aov(aov: Aov) -> CliError {
    CliError::input(format!(
        "a reference has no --aov {aov}, which depends on settings of techniques; `lumivox render` \
         has it"
    ))
}

fn settings(args: &Args) -> Result<Settings, CliError> {
    let (width, height) = args.picture.size;
    let sampling = match args.spp {
        Some(spp) => Sampling::Fixed { spp },
        None => Sampling::Adaptive {
            max_error: args.max_error as f32,
            max_spp: args.max_spp,
        },
    };
    Ok(Settings {
        width,
        height,
        bounces: args.bounces,
        filter: args.filter,
        sampling,
        seed: args.seed,
        occlusion: args.occlusion.definition()?,
    })
}

fn patch_settings(args: &Args) -> RadiositySettings {
    RadiositySettings {
        rays: args.patch_rays,
        max_error: args.patch_error,
        max_patches: args.max_patches,
        ..RadiositySettings::default()
    }
}

/// A bar on stderr, where that is a terminal.
fn progress_bar(quiet: bool) -> ProgressBar {
    if quiet {
        return ProgressBar::hidden();
    }
    let style =
        ProgressStyle::with_template("reference {bar:40} {percent}% {elapsed} (about {eta} left)")
            .unwrap_or_else(|_| ProgressStyle::default_bar());
    ProgressBar::new(1000).with_style(style)
}

fn report(args: &Args, scene: &Scene, shot: &Shot) -> serde_json::Value {
    let is_solved = args.method == Method::Radiosity;
    serde_json::json!({
        "schema_version": 1,
        "version": env!("CARGO_PKG_VERSION"),
        "scene": scene.name,
        "time_s": args.scene.time_s(),
        "sequence": args.sequence.row(shot),
        "technique": "reference",
        "settings": {
            "width": args.picture.size.0,
            "height": args.picture.size.1,
            "method": args.method.name(),
            "patch_error": is_solved.then_some(args.patch_error),
            "bounces": args.bounces,
            "filter": match args.filter { Filter::Center => "center", Filter::Box => "box" },
            "spp": args.spp,
            "max_error": args.spp.is_none().then_some(args.max_error),
            "max_spp": args.spp.is_none().then_some(args.max_spp),
            "seed": args.seed,
        },
        "aov": args.picture.aov.name(),
    })
}

/// A number of bounces, or `full`.
pub(super) fn parse_bounces(text: &str) -> Result<Bounces, String> {
    match text {
        "full" => Ok(Bounces::Full),
        _ => text
            .parse()
            .map(Bounces::Count)
            .map_err(|_| String::from("write a number of bounces, or full")),
    }
}

fn parse_filter(text: &str) -> Result<Filter, String> {
    match text {
        "center" => Ok(Filter::Center),
        "box" => Ok(Filter::Box),
        _ => Err(String::from("write center or box")),
    }
}
