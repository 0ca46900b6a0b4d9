//! `lumivox fit`: the cheapest technique and settings that meet a bound.

use std::collections::BTreeSet;
use std::path::PathBuf;

use crate::measure::bench::{Case, open};
use crate::measure::chart::{PictureFolder, Progress, Sweep, bounces_text};
use crate::measure::fit::{Bounds, Fit, SceneTrial, TrialProgress, TrialSettings, View, cases_at};
use crate::measure::records::Records;
use crate::reference::{Bounces, cache_dir};
use crate::scene::{Scene, camera_toml};

use super::CliError;
use super::chart::{failed, grid};
use super::common::{SceneArgs, check_positive, progress_count, say};
use super::files::{Files, check_results_folder};
use super::measured::MeasureArgs;
use super::reference::parse_bounces;
use super::sequence::PathArgs;
use super::stop;
use super::write::{check_output_folder, make_folder, stems, write_report};

/// Find the cheapest technique and settings that meet bounds on a scene, by measuring few points
/// of a grid. With --max-error that is the least time, and otherwise the least error.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n\
\x20 lumivox fit bundled:cornell --max-error 0.05\n\
\x20 lumivox fit room.toml --max-ms 8 --max-mib 64 --size 640x360 -o out")]
pub(crate) struct Args {
    /// Error that the indirect light may have, relative to the mean of the reference: 0.05 is 5%.
    #[arg(long, value_name = "E", help_heading = "Bounds")]
    max_error: Option<f32>,
    /// Time that the indirect light of a frame may take (ms).
    #[arg(long, value_name = "T", help_heading = "Bounds")]
    max_ms: Option<f32>,
    /// Memory that the technique may keep in the world (MiB).
    #[arg(long, value_name = "M", help_heading = "Bounds")]
    max_mib: Option<f32>,
    /// Geometry moves: the time of a frame has a build in it.
    #[arg(long, help_heading = "Bounds")]
    moving: bool,
    /// Indirect bounces that are computed, and that the reference has: a number, or full.
    #[arg(long, value_name = "N|full", default_value = "1", value_parser = parse_bounces)]
    bounces: Bounces,
    /// Which techniques with which settings (docs/chart.md) [default: a grid of all techniques].
    #[arg(long, value_name = "FILE.toml")]
    grid: Option<PathBuf>,
    /// Sample the reference until the standard error of 8x8-pixel means is below this, relative to
    /// the mean.
    #[arg(long, value_name = "X", default_value_t = 0.01)]
    noise: f64,
    /// The folder for NAME.jsonl and pictures, as of `lumivox chart`. Points that have a record
    /// there are not measured again.
    #[arg(short, long, value_name = "DIR", default_value = "out")]
    output: PathBuf,
    /// Write the answer as JSON.
    #[arg(long, value_name = "FILE.json")]
    report: Option<PathBuf>,
    #[command(flatten)]
    scene: SceneArgs,
    #[command(flatten)]
    views: ViewArgs,
    #[command(flatten)]
    measure: MeasureArgs,
}

/// The views that the bounds hold for.
#[derive(clap::Args)]
#[command(next_help_heading = "Views")]
struct ViewArgs {
    /// Views along a path of the camera, from the scene's own on. The bounds hold in each.
    #[arg(
        long,
        value_name = "N",
        default_value_t = 1,
        value_parser = clap::value_parser!(u32).range(1..=100),
    )]
    views: u32,
    /// One more view, as `lumivox view` copies it: 'camera = { eye = [0.0, 1.0, 2.0], target =
    /// [0.0, 1.0, 0.0] }', or TOML of lights or an environment; may be repeated.
    #[arg(long, value_name = "TOML")]
    at: Vec<String>,
    #[command(flatten)]
    path: PathArgs,
}

impl ViewArgs {
    /// The views of a scene, and each as commands name it.
    fn of(&self, scene: &Scene, args: &SceneArgs) -> Result<Vec<(Scene, String)>, CliError> {
        let given = self.path.given();
        if self.views == 1 && !given.is_empty() {
            return Err(CliError::input(format!(
                "{} makes no difference to one view; say with --views how many the path has",
                given.join(", ")
            )));
        }
        self.path.check(self.views)?;
        let shot = self.path.shot(scene, args.time_s());
        if self.views > 1 && shot.is_still() {
            return Err(CliError::input(format!(
                "--views is {}, and all of them are the same; give --pan, --dolly or --fps, or \
                 single views with --at",
                self.views
            )));
        }
        let of_path = |index: u32| {
            let mut view = scene.clone();
            let time_s = match shot.place(&mut view, index) {
                true => Some(shot.time_s(index)),
                false => args.time_s(),
            };
            let camera = (index > 0).then(|| camera_toml(&view.camera));
            let words = args.words(time_s, camera.as_slice());
            (view, words)
        };
        let at = |text: &String| {
            let mut view = scene.clone();
            view.overlay("--at", text).map_err(CliError::input)?;
            Ok((view, args.words(args.time_s(), std::slice::from_ref(text))))
        };
        let of_path = (0..self.views).map(|index| Ok(of_path(index)));
        of_path.chain(self.at.iter().map(at)).collect()
    }
}

/// Searches, then tells what was found. That nothing meets the bounds is a failure.
pub(crate) fn run(args: &Args, quiet: bool) -> Result<(), CliError> {
    let bounds = bounds(args)?;
    let mut files = Files::default();
    args.report
        .iter()
        .try_for_each(|path| files.write(path, &["json"]))?;
    let grid = grid(args.grid.as_deref())?;
    let cases = cases_at(&grid, args.bounces);
    if cases.is_empty() {
        return Err(CliError::input(format!(
            "no technique of the grid computes {}; choose other --bounces, or another --grid",
            bounces_text(args.bounces)
        )));
    }
    warn_of_left_out(&grid, &cases, args.bounces);
    check_output_folder(&args.output)?;
    let scene = args.scene.open(&mut files)?;
    check_results_folder(&args.output, std::slice::from_ref(&scene))?;
    let views = args.views.of(&scene, &args.scene)?;
    let fit = search(args, &views, cases, bounds, quiet)?;
    fit.lines().iter().for_each(|line| say(line));
    if let Some(path) = &args.report {
        write_report(path, &serde_json::to_value(&fit).map_err(CliError::failed)?)?;
    }
    match fit.best {
        Some(_) => Ok(()),
        None => Err(CliError::failed(format!(
            "no point that was measured has {}; loosen a bound, or see what comes nearest",
            fit.bounds_text()
        ))),
    }
}

/// Techniques of the grid that do not compute so many bounces.
fn warn_of_left_out(grid: &[Case], cases: &[Case], bounces: Bounces) {
    let names =
        |cases: &[Case]| -> BTreeSet<&str> { cases.iter().map(|case| case.entry.name).collect() };
    let (all, searched) = (names(grid), names(cases));
    let left_out: Vec<&str> = all.difference(&searched).copied().collect();
    if !left_out.is_empty() {
        log::warn!(
            "left out, as they do not compute {}: {}",
            bounces_text(bounces),
            left_out.join(", ")
        );
    }
}

fn bounds(args: &Args) -> Result<Bounds, CliError> {
    let all = [
        ("--max-error", args.max_error),
        ("--max-ms", args.max_ms),
        ("--max-mib", args.max_mib),
        ("--noise", Some(args.noise as f32)),
    ];
    for (option, value) in all {
        check_positive(option, value)?;
    }
    if all[..3].iter().all(|(_, value)| value.is_none()) {
        return Err(CliError::input(
            "there is no bound to meet; give --max-error E, --max-ms T or --max-mib M, or several",
        ));
    }
    let (noise, max_error) = (args.noise as f32, args.max_error);
    if let Some(max_error) = max_error.filter(|max_error| *max_error < noise) {
        return Err(CliError::input(format!(
            "--max-error {max_error} is below the error of the reference itself, {noise}; allow \
             more, or give a lower --noise"
        )));
    }
    let bound = |value: Option<f32>| value.map_or(f64::INFINITY, f64::from);
    Ok(Bounds {
        max_error: bound(max_error),
        max_ms: bound(args.max_ms),
        max_bytes: bound(args.max_mib) * f64::from(1 << 20),
    })
}

/// The same view twice costs time and says nothing.
fn check_that_views_differ(sweeps: &[Sweep<'_>]) -> Result<(), CliError> {
    for (index, sweep) in sweeps.iter().enumerate() {
        let mut before = sweeps[..index].iter();
        if let Some(same) = before.position(|other| other.is_of_same_view(sweep)) {
            return Err(CliError::input(format!(
                "views {} and {} are the same; change the path, or leave one out",
                same + 1,
                index + 1
            )));
        }
    }
    Ok(())
}

/// An error unless errors can be judged by the reference of a view; `noise` is its own, and `None`
/// where it shows no light.
fn check_reference(view: &str, noise: Option<f64>, bounds: &Bounds) -> Result<(), CliError> {
    let Some(noise) = noise else {
        return Err(CliError::input(format!(
            "{view}: the reference shows no indirect light, to which an error could be relative; \
             move the camera, give the scene light, or leave the view out"
        )));
    };
    if noise > bounds.max_error {
        return Err(CliError::input(format!(
            "{view}: the reference itself has an error of {noise:.2e}, above --max-error {}; \
             allow more",
            bounds.max_error
        )));
    }
    Ok(())
}

/// Measures on the device, with a bar that tells what.
fn search(
    args: &Args,
    views: &[(Scene, String)],
    cases: Vec<Case>,
    bounds: Bounds,
    quiet: bool,
) -> Result<Fit, CliError> {
    let settings = args.measure.settings()?;
    let gpu = open(&settings.gpu, settings.timing).map_err(CliError::failed)?;
    make_folder(&args.output)?;
    let name = views.first().map_or("", |(scene, _)| &scene.name);
    let stem = stems([name].into_iter(), &args.output).remove(0);
    let mut records = Records::open(&stem.with_extension("jsonl")).map_err(CliError::failed)?;
    stop::keeps("the points that were measured are kept; the same command measures the others");
    let (cache, pictures) = (cache_dir(), PictureFolder::of(&args.output));
    let bar = progress_count(quiet);
    let sweeps: Vec<Sweep<'_>> = views
        .iter()
        .map(|(scene, _)| Sweep::new(&gpu, scene, &settings, args.noise))
        .collect();
    check_that_views_differ(&sweeps)?;
    let view = |((sweep, (_, source)), number): ((_, &(Scene, String)), usize)| {
        let mut run = Sweep::start(sweep, &cache, &pictures);
        let mut tell = |step: Progress<'_>| {
            if let Progress::Reference(bounces) = step {
                bar.set_message(format!("reference, {}", bounces_text(bounces)));
            }
        };
        let noise = run.prepare(args.bounces, &mut tell).map_err(failed)?;
        check_reference(&format!("view {number}, {source}"), noise, &bounds)?;
        Ok(View::new(source.clone(), sweep, run))
    };
    let views = sweeps.iter().zip(views).zip(1..).map(view);
    let views = views.collect::<Result<_, CliError>>()?;
    let mut progress = |step: TrialProgress<'_>| match step {
        TrialProgress::Measuring(case) => bar.set_message(case.entry.name),
        TrialProgress::Done(point) => {
            point.failure.iter().for_each(|failure| {
                bar.suspend(|| log::warn!("{} {}: {failure}", point.name(), point.changes_text()))
            });
            bar.inc(1);
        }
    };
    let is_moving = args.moving;
    let settings = TrialSettings { bounds, is_moving };
    let mut trial = SceneTrial::new(views, &mut records, &settings, cases, &mut progress);
    let fit = Fit::search(&mut trial, args.bounces).map_err(failed)?;
    bar.finish_and_clear();
    Ok(fit)
}
