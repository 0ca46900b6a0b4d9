//! `lumivox compare`: how far one image is from another.

use std::ffi::OsString;
use std::path::PathBuf;

use crate::image::{Image, luminance, read_exr, write_bins, write_heatmap};
use crate::metrics::{Channel, Comparison, Errors, Flip, compare, error_image, exposure_of, flip};
use crate::reference::guide;
use crate::scene::{LoadOptions, Scene, Up};

use super::common::{TimeArgs, check_positive, parse_channel, parse_up, say};
use super::files::Files;
use super::sequence::{Numbered, PathArgs};
use super::write::write_report;
use super::{CliError, compare_frames};

/// Compare an image with a reference, both linear EXR.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n\
\x20 lumivox compare image.exr reference.exr --scene bundled:cornell --heatmap error.png\n\
\x20 lumivox compare pan_####.exr r_####.exr --scene bundled:cornell --pan 1 --chart pan.svg")]
pub(crate) struct Args {
    /// The image to judge (.exr). A run of # in its name stands for the number of a frame, from 0
    /// on: then it is a sequence.
    pub(super) image: PathBuf,
    /// The reference to judge it by (.exr): of a sequence another one, or one picture for all
    /// frames.
    pub(super) reference: PathBuf,
    /// Compare luminance, or red, green and blue.
    #[arg(
        long,
        value_name = "luminance|rgb",
        default_value = "luminance",
        value_parser = parse_channel,
    )]
    pub(super) channel: Channel,
    /// The scene that both images show from its camera: leaves out pixels without a surface, and
    /// adds the errors over blocks and by material.
    #[arg(long)]
    pub(super) scene: Option<OsString>,
    /// Render missing textures mid-grey instead of failing.
    #[arg(long, requires = "scene")]
    allow_missing_textures: bool,
    /// The axis that points up in an .obj given alone.
    #[arg(
        long,
        value_name = "y|z",
        default_value = "y",
        value_parser = parse_up,
        requires = "scene",
    )]
    up: Up,
    /// The technique's own pictures as they are without history, a sequence or one picture (.exr):
    /// the lag of each frame behind them.
    #[arg(long, value_name = "FILE.exr", help_heading = "Sequence")]
    pub(super) converged: Option<PathBuf>,
    /// The technique's own picture before a change of light, without noise (.exr): with --after,
    /// the share of the change that each frame shows.
    #[arg(
        long,
        value_name = "FILE.exr",
        requires = "after",
        help_heading = "Sequence"
    )]
    pub(super) before: Option<PathBuf>,
    /// The same after the change.
    #[arg(
        long,
        value_name = "FILE.exr",
        requires = "before",
        help_heading = "Sequence"
    )]
    pub(super) after: Option<PathBuf>,
    /// Draw error and bias over time.
    #[arg(long, value_name = "FILE.svg|.png", help_heading = "Sequence")]
    pub(super) chart: Option<PathBuf>,
    /// Factor applied to both images before the clamp that FLIP sees [default: mean luminance of
    /// the reference to 0.18].
    #[arg(long, value_name = "X")]
    pub(super) exposure: Option<f32>,
    /// Write the luminance of the difference as a heat map.
    #[arg(long, value_name = "FILE.png")]
    pub(super) heatmap: Option<PathBuf>,
    /// The difference shown brightest [default: the mean luminance of the reference].
    #[arg(long, value_name = "X", requires = "heatmap")]
    heatmap_scale: Option<f32>,
    /// Write the sum of the differences of red, green and blue, at the exposure that FLIP sees, in
    /// three colours: red to 0.1, green to 0.2, blue above.
    #[arg(long, value_name = "FILE.png")]
    pub(super) bins: Option<PathBuf>,
    /// Write the metrics as JSON (a metric that is not finite is null; parts of a path that are not
    /// UTF-8 become U+FFFD).
    #[arg(long, value_name = "FILE.json")]
    pub(super) report: Option<PathBuf>,
    #[command(flatten)]
    pub(super) time: TimeArgs,
    #[command(flatten)]
    pub(super) path: PathArgs,
}

impl Args {
    /// The scene that is shown, at its time.
    pub(super) fn open_scene(&self, files: &mut Files) -> Result<Option<Scene>, CliError> {
        let Some(source) = &self.scene else {
            return Ok(None);
        };
        files.read_source(source)?;
        let options = LoadOptions {
            allow_missing_textures: self.allow_missing_textures,
            up: self.up,
        };
        let mut scene = Scene::open(source, &options).map_err(CliError::input)?;
        files.read_scene(&scene)?;
        self.time.apply(&mut scene)?;
        Ok(Some(scene))
    }

    /// An error if what only a sequence has is asked of two pictures.
    fn check_pair(&self) -> Result<(), CliError> {
        let given = [
            ("--converged", self.converged.is_some()),
            ("--before", self.before.is_some()),
            ("--chart", self.chart.is_some()),
        ];
        match given.into_iter().find(|(_, is_given)| *is_given) {
            Some((option, _)) => Err(CliError::input(format!(
                "{option} is for sequences; name one, as in image_####.exr"
            ))),
            None => self.path.check(1),
        }
    }
}

/// Fewer blocks than this say little of an image.
const FEW_BLOCKS: usize = 16;

/// Reads, compares, prints.
pub(crate) fn run(args: &Args) -> Result<(), CliError> {
    check_positive("--exposure", args.exposure)?;
    check_positive("--heatmap-scale", args.heatmap_scale)?;
    let name = Numbered::of(&args.image)?;
    if let Some(name) = &name {
        return compare_frames::run(args, name);
    }
    if Numbered::of(&args.reference)?.is_some() {
        return Err(CliError::input(format!(
            "{} is a sequence and {} is one picture; compare it with a sequence",
            args.reference.display(),
            args.image.display()
        )));
    }
    args.check_pair()?;
    let mut files = Files::default();
    files.read(&args.image)?;
    files.read(&args.reference)?;
    args.scene
        .iter()
        .try_for_each(|source| files.read_source(source))?;
    let written = [
        (&args.heatmap, "png"),
        (&args.bins, "png"),
        (&args.report, "json"),
    ];
    for (path, extension) in written {
        path.iter()
            .try_for_each(|path| files.write(path, &[extension]))?;
    }
    let image = read_exr(&args.image).map_err(CliError::input)?;
    let reference = read_exr(&args.reference).map_err(CliError::input)?;
    let scene = args.open_scene(&mut files)?;
    let guide = scene
        .as_ref()
        .map(|scene| guide(scene, reference.width, reference.height))
        .transpose()
        .map_err(CliError::input)?;
    let comparison =
        compare(&image, &reference, guide.as_ref(), args.channel).map_err(CliError::input)?;
    let exposure = args.exposure.unwrap_or_else(|| exposure_of(&reference));
    let flip = flip(&image, &reference, exposure).map_err(CliError::input)?;
    let names: Vec<&str> = scene
        .iter()
        .flat_map(|scene| &scene.materials)
        .map(|material| material.name.as_str())
        .collect();
    print_table(&comparison, &flip, &names);
    if let Some(path) = &args.heatmap {
        let scale = args
            .heatmap_scale
            .unwrap_or_else(|| mean_luminance(&reference));
        let difference = error_image(&image, &reference).map_err(CliError::input)?;
        write_heatmap(path, &difference, scale).map_err(CliError::failed)?;
        say(&format!(
            "{}: black is no difference, the brightest a difference in luminance of {scale:.4} or \
             more",
            path.display()
        ));
    }
    if let Some(path) = &args.bins {
        let difference = error_image(&image, &reference).map_err(CliError::input)?;
        let shares = write_bins(path, &difference, exposure).map_err(CliError::failed)?;
        let [red, green, blue] = shares.map(|share| 100.0 * share);
        say(&format!(
            "{}: red is a difference up to 0.1 ({red:.1}% of the pixels), green up to 0.2 \
             ({green:.1}%), blue above ({blue:.1}%), at exposure {exposure:.4}",
            path.display()
        ));
    }
    match &args.report {
        Some(path) => write_report(path, &report(args, &comparison, &flip, &names)),
        None => Ok(()),
    }
}

fn mean_luminance(image: &Image) -> f32 {
    let sum: f64 = image
        .pixels
        .iter()
        .map(|&pixel| f64::from(luminance(pixel)))
        .sum();
    ((sum / image.pixels.len().max(1) as f64) as f32).max(f32::MIN_POSITIVE)
}

fn print_table(comparison: &Comparison, flip: &Flip, names: &[&str]) {
    let width = names
        .iter()
        .map(|name| name.chars().count())
        .max()
        .unwrap_or(0)
        .max(5);
    say(&format!(
        "{:width$}  {:6} {:>9} {:>10} {:>9} {:>9} {:>9} {:>9}",
        "over", "of", "values", "mean R", "bias", "rel_rmse", "rel_mse", "p95"
    ));
    let row = |name: &str, of: &str, errors: &Errors| {
        let Errors {
            rel_rmse,
            bias,
            rel_mse,
            p95,
            mean_reference,
            count,
        } = errors;
        say(&format!(
            "{name:width$}  {of:6} {count:>9} {mean_reference:>10.5} {bias:>+9.5} {rel_rmse:>9.5} \
             {rel_mse:>9.5} {p95:>9.5}"
        ));
    };
    let rows = |name: &str, pixel: &Errors, block: &Option<Errors>| {
        row(name, "pixel", pixel);
        block.iter().for_each(|block| row(name, "block", block));
    };
    rows("image", &comparison.pixel, &comparison.block);
    for errors in &comparison.materials {
        rows(
            names.get(errors.material as usize).copied().unwrap_or("?"),
            &errors.pixel,
            &errors.block,
        );
    }
    if let Some(block) = &comparison.block
        && block.count < FEW_BLOCKS
    {
        say(&format!(
            "few blocks lie on one plane and material: judge by pixels, or by larger images: {}",
            block.count
        ));
    }
    say(&format!(
        "flip mean {:.5}, 99th percentile {:.5} (exposure {:.4}, clamped, sRGB)",
        flip.mean, flip.p99, flip.exposure
    ));
}

fn report(args: &Args, comparison: &Comparison, flip: &Flip, names: &[&str]) -> serde_json::Value {
    let materials: Vec<serde_json::Value> = comparison
        .materials
        .iter()
        .map(|errors| {
            serde_json::json!({ "material": names.get(errors.material as usize),
            "pixel": errors.pixel, "block": errors.block })
        })
        .collect();
    serde_json::json!({
        "schema_version": 1,
        "version": env!("CARGO_PKG_VERSION"),
        "image": args.image.to_string_lossy(),
        "reference": args.reference.to_string_lossy(),
        "scene": args.scene.as_ref().map(|scene| scene.to_string_lossy()),
        "error": {
            "channel": comparison.channel,
            "pixel": comparison.pixel,
            "block": comparison.block,
            "flip": flip,
            "materials": materials,
        },
    })
}
