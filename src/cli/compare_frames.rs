//! `lumivox compare` of sequences: error over time.

use std::path::{Path, PathBuf};

use crate::image::{GuideImage, Image, read_exr};
use crate::measure::over_time::{FrameErrors, OverTime, Own, SQUARE_PX, Steadiness};
use crate::measure::report::SequenceRow;
use crate::metrics::Errors;
use crate::metrics::stability::shown_from;
use crate::reference::guide;
use crate::scene::{Scene, Shot};

use super::CliError;
use super::common::say;
use super::compare::Args;
use super::files::Files;
use super::sequence::Numbered;
use super::write::write_report;

/// Shares of a change whose frames are told.
const SHARES: [f64; 2] = [0.9, 0.99];

/// Pictures of a sequence, or one for all its frames.
struct Pictures {
    path: PathBuf,
    name: Option<Numbered>,
}

impl Pictures {
    fn of(path: &Path) -> Result<Self, CliError> {
        Ok(Pictures {
            path: path.to_owned(),
            name: Numbered::of(path)?,
        })
    }

    fn path(&self, frame: u32) -> PathBuf {
        self.name
            .as_ref()
            .map_or_else(|| self.path.clone(), |name| name.path(frame))
    }

    /// Notes all files as read.
    fn read_all(&self, frames: u32, files: &mut Files) -> Result<(), CliError> {
        let last = if self.name.is_some() { frames } else { 1 };
        for path in (0..last).map(|frame| self.path(frame)) {
            if !path.exists() {
                return Err(CliError::input(format!(
                    "there is no {}; all {frames} frames of the image need one",
                    path.display()
                )));
            }
            files.read(&path)?;
        }
        Ok(())
    }

    fn read(&self, frame: u32) -> Result<Image, CliError> {
        read_exr(&self.path(frame)).map_err(CliError::input)
    }
}

/// Reads, compares and prints frame by frame.
pub(super) fn run(args: &Args, name: &Numbered) -> Result<(), CliError> {
    check_options(args)?;
    let mut files = Files::default();
    args.chart
        .iter()
        .try_for_each(|path| files.write(path, &["svg", "png"]))?;
    args.report
        .iter()
        .try_for_each(|path| files.write(path, &["json"]))?;
    let frames = name.count();
    if frames == 0 {
        return Err(CliError::input(format!(
            "there is no {}; frames are numbered from 0 on",
            name.path(0).display()
        )));
    }
    args.path.check(frames)?;
    let images = Pictures::of(&args.image)?;
    let references = Pictures::of(&args.reference)?;
    let converged = args.converged.as_deref().map(Pictures::of).transpose()?;
    for pictures in [&images, &references].into_iter().chain(&converged) {
        pictures.read_all(frames, &mut files)?;
    }
    for path in args.before.iter().chain(&args.after) {
        files.read(path)?;
    }
    args.scene
        .iter()
        .try_for_each(|source| files.read_source(source))?;
    let change = match (&args.before, &args.after) {
        (Some(before), Some(after)) => Some([
            read_exr(before).map_err(CliError::input)?,
            read_exr(after).map_err(CliError::input)?,
        ]),
        _ => None,
    };
    let mut guides = Guides::of(args, args.open_scene(&mut files)?);
    let mut over_time = OverTime::default();
    for frame in 0..frames {
        let (image, reference) = (images.read(frame)?, references.read(frame)?);
        let converged = converged.as_ref().map(|own| own.read(frame)).transpose()?;
        let own = Own {
            converged: converged.as_ref(),
            change: change.as_ref().map(|[before, after]| [before, after]),
        };
        let guide = guides.at(frame, &reference)?;
        over_time
            .add([&image, &reference], guide, args.channel, own)
            .map_err(|error| {
                let path = images.path(frame);
                CliError::input(format!("{}: {error}", path.display()))
            })?;
    }
    let steadiness = over_time.steadiness().map_err(CliError::input)?;
    say(&format!(
        "{frames} frames, {} to {}",
        images.path(0).display(),
        images.path(frames - 1).display()
    ));
    print_table(&over_time, steadiness);
    if let Some(path) = &args.chart {
        let notes = vec![format!(
            "{} against {}",
            args.image.display(),
            args.reference.display()
        )];
        let chart = over_time.chart("error over time".to_owned(), notes);
        let is_svg = path
            .extension()
            .is_some_and(|extension| extension.eq_ignore_ascii_case("svg"));
        let written = match is_svg {
            true => chart.write_svg(path),
            false => chart.write_png(path),
        };
        written.map_err(CliError::failed)?;
    }
    match &args.report {
        Some(path) => {
            let shot = guides.scene.as_ref().map(|(_, shot)| shot);
            let sequence = shot.and_then(|shot| args.path.row(frames, shot));
            write_report(path, &report(args, sequence, &over_time, steadiness))
        }
        None => Ok(()),
    }
}

/// An error if something is asked that only two pictures have.
fn check_options(args: &Args) -> Result<(), CliError> {
    let given = [
        ("--heatmap", args.heatmap.is_some()),
        ("--bins", args.bins.is_some()),
        ("--exposure", args.exposure.is_some()),
    ];
    if let (None, [option, ..]) = (&args.scene, args.path.given().as_slice()) {
        return Err(CliError::input(format!(
            "{option} says where a scene is seen from; name it with --scene"
        )));
    }
    match given.into_iter().find(|(_, is_given)| *is_given) {
        Some((option, _)) => Err(CliError::input(format!(
            "{option} is for two pictures, and {} is a sequence; name one of its frames",
            args.image.display()
        ))),
        None => Ok(()),
    }
}

/// What the pixels of each frame see.
struct Guides {
    scene: Option<(Scene, Shot)>,
    last: Option<GuideImage>,
}

impl Guides {
    fn of(args: &Args, scene: Option<Scene>) -> Self {
        let with_shot = |scene: Scene| {
            let shot = args.path.shot(&scene, args.time.time_s());
            (scene, shot)
        };
        Guides {
            scene: scene.map(with_shot),
            last: None,
        }
    }

    /// Of a frame of this picture's size; `None` without a scene.
    fn at(&mut self, frame: u32, picture: &Image) -> Result<Option<&GuideImage>, CliError> {
        let Some((scene, shot)) = &mut self.scene else {
            return Ok(None);
        };
        if self.last.is_none() || !shot.is_still() {
            shot.place(scene, frame);
            let guide = guide(scene, picture.width, picture.height).map_err(CliError::input)?;
            self.last = Some(guide);
        }
        Ok(self.last.as_ref())
    }
}

/// The columns of the table: what they are over, their names, and what they show.
type Column = (&'static str, &'static str, fn(&FrameErrors) -> Option<f64>);

const COLUMNS: [Column; 6] = [
    ("pixel", "rel_rmse", |frame| Some(frame.pixel.rel_rmse)),
    ("pixel", "bias", |frame| Some(frame.pixel.bias)),
    ("block", "rel_rmse", |frame| Some(frame.block?.rel_rmse)),
    ("block", "bias", |frame| Some(frame.block?.bias)),
    ("own", "lag", |frame| frame.lag),
    ("own", "shown", |frame| frame.shown),
];

fn print_table(over_time: &OverTime, steadiness: Option<Steadiness>) {
    let columns: Vec<&Column> = COLUMNS
        .iter()
        .filter(|(.., of)| over_time.mean(of).is_some())
        .collect();
    let line = |first: &str, cells: &dyn Fn(&Column) -> String| {
        let cells = columns
            .iter()
            .map(|column| format!(" {:>9}", cells(column)));
        say(&cells.fold(format!("{first:>5}"), |line, cell| line + &cell));
    };
    let number = |value: Option<f64>| value.map_or("–".to_owned(), |value| format!("{value:.5}"));
    line("", &|(over, ..)| (*over).to_owned());
    line("frame", &|(_, name, _)| (*name).to_owned());
    for (index, frame) in over_time.frames.iter().enumerate() {
        line(&index.to_string(), &|(.., of)| number(of(frame)));
    }
    line("mean", &|(.., of)| number(over_time.mean(of)));
    if let Some(Steadiness { flicker, popping }) = steadiness {
        say(&format!(
            "flicker {flicker:.5}, popping {popping:.5} (means of {SQUARE_PX}×{SQUARE_PX} pixels)"
        ));
    }
    let shown = shown(over_time);
    for share in SHARES.into_iter().filter(|_| !shown.is_empty()) {
        let percent = 100.0 * share;
        say(&match shown_from(&shown, share) {
            Some(frame) => format!("{percent}% of the change is shown from frame {frame} on"),
            None => format!("{percent}% of the change is not shown"),
        });
    }
}

/// The share of the change that each frame shows; empty without one.
fn shown(over_time: &OverTime) -> Vec<f64> {
    let shown = over_time.values(|frame| frame.shown);
    shown.into_iter().map(|(_, shown)| shown).collect()
}

fn report(
    args: &Args,
    sequence: Option<SequenceRow>,
    over_time: &OverTime,
    steadiness: Option<Steadiness>,
) -> serde_json::Value {
    let errors = |of: &dyn Fn(&FrameErrors) -> Option<Errors>| {
        let mean = |value: &dyn Fn(Errors) -> f64| over_time.mean(|frame| of(frame).map(value));
        serde_json::json!({
            "rel_rmse": mean(&|errors| errors.rel_rmse),
            "bias": mean(&|errors| errors.bias),
            "rel_mse": mean(&|errors| errors.rel_mse),
            "p95": mean(&|errors| errors.p95),
        })
    };
    let shown = shown(over_time);
    let shares = SHARES.map(
        |share| serde_json::json!({ "share": share, "from_frame": shown_from(&shown, share) }),
    );
    serde_json::json!({
        "schema_version": 1,
        "version": env!("CARGO_PKG_VERSION"),
        "image": args.image.to_string_lossy(),
        "reference": args.reference.to_string_lossy(),
        "scene": args.scene.as_ref().map(|scene| scene.to_string_lossy()),
        "sequence": sequence,
        "channel": args.channel,
        "frames": over_time.frames,
        "mean": {
            "pixel": errors(&|frame| Some(frame.pixel)),
            "block": errors(&|frame| frame.block),
            "lag": over_time.mean(|frame| frame.lag),
        },
        "flicker": steadiness.map(|steadiness| steadiness.flicker),
        "popping": steadiness.map(|steadiness| steadiness.popping),
        "shown": (!shown.is_empty()).then_some(shares),
    })
}
