//! `lumivox chart`: speed and memory against error, over a grid of techniques and settings.

use std::cmp::Reverse;
use std::collections::BTreeSet;
use std::ffi::OsString;
use std::path::{Path, PathBuf};

use crate::measure::bench::{Case, open};
use crate::measure::chart::{
    Cost, DEFAULT_GRID, PictureFolder, Point, Progress, Section, Sweep, SweepError, Troubles,
    bounces_text, grid_cases, measure_left_out, page,
};
use crate::measure::records::{Keyed as _, Records, newest, read_records, record_files};
use crate::reference::cache_dir;
use crate::scene::Scene;
use crate::text::counted;

use super::CliError;
use super::common::{LoadArgs, check_scenes, progress_bar, say};
use super::files::check_results_folder;
use super::measured::MeasureArgs;
use super::stop;
use super::write::{chart_stem, check_output_folder, make_folder, stems, write_text};

/// Chart speed and memory against error: every technique with many settings, the Pareto front, one
/// page to read.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n\
\x20 lumivox chart bundled:cornell -o out\n\
\x20 lumivox chart room.toml --grid grid.toml --size 320x240 -o out")]
pub(crate) struct Args {
    /// `bundled:NAME`, or the path of a .toml, .obj, .gltf or .glb file.
    #[arg(required_unless_present_any = ["merge", "list"])]
    scene: Vec<OsString>,
    /// Which techniques with which settings (docs/chart.md) [default: a grid of all techniques].
    #[arg(long, value_name = "FILE.toml")]
    grid: Option<PathBuf>,
    /// Only print the points of the grid.
    #[arg(long, conflicts_with_all = ["merge", "shard"])]
    list: bool,
    /// Sample the reference until the standard error of 8x8-pixel means is below this, relative to
    /// the mean.
    #[arg(long, value_name = "X", default_value_t = 0.01)]
    max_error: f64,
    /// Measure every n-th point only, from the i-th, and write nothing but its records, as
    /// NAME-shard-i-of-n.jsonl.
    #[arg(long, value_name = "i/n", value_parser = parse_shard)]
    shard: Option<Shard>,
    /// Measure nothing: gather the records of these folders, such as the folders of shards.
    #[arg(
        long,
        value_name = "DIR",
        num_args = 1..,
        conflicts_with_all = ["scene", "grid", "shard"],
    )]
    merge: Vec<PathBuf>,
    /// A folder of results of `lumivox stress`, which the page shows beside what it recommends
    /// [default: `stress` in the folder of -o, where there is one].
    #[arg(long, value_name = "DIR", conflicts_with_all = ["list", "shard"])]
    stress: Option<PathBuf>,
    /// The folder for chart.html and each scene's NAME.jsonl, NAME.csv, NAME-*.svg and NAME-*.png.
    /// Points that have a record there are not measured again.
    #[arg(short, long, value_name = "DIR", required_unless_present = "list")]
    output: Option<PathBuf>,
    #[command(flatten)]
    load: LoadArgs,
    #[command(flatten)]
    measure: MeasureArgs,
}

/// The part of a sweep that one process measures: every `count`-th point, from the `index`-th,
/// counted from 1.
#[derive(Clone, Copy)]
struct Shard {
    index: usize,
    count: usize,
}

/// Measures what has no record, or gathers records; then writes what they say.
pub(crate) fn run(args: &Args, quiet: bool) -> Result<(), CliError> {
    if !(args.max_error.is_finite() && args.max_error > 0.0) {
        return Err(CliError::input(format!(
            "--max-error is {}; it must be above 0",
            args.max_error
        )));
    }
    let Some(folder) = args.output.as_ref().filter(|_| !args.list) else {
        return list(args);
    };
    let troubles = troubles(args, folder)?;
    if !args.merge.is_empty() {
        check_output_folder(folder)?;
        return merge(&args.merge, &troubles, folder, quiet);
    }
    let cases = grid(args.grid.as_deref())?;
    check_output_folder(folder)?;
    let options = args.load.options();
    let scenes: Vec<Scene> = args
        .scene
        .iter()
        .map(|scene| Scene::open(scene, &options))
        .collect::<Result<_, _>>()
        .map_err(CliError::input)?;
    check_scenes(&scenes)?;
    check_results_folder(folder, &scenes)?;
    let settings = args.measure.settings()?;
    let gpu = open(&settings.gpu, settings.timing).map_err(CliError::failed)?;
    make_folder(folder)?;
    let stems = stems(scenes.iter().map(|scene| scene.name.as_str()), folder);
    let mut sections = Vec::new();
    for ((scene, source), stem) in scenes.iter().zip(&args.scene).zip(&stems) {
        let sweep = Sweep::new(&gpu, scene, &settings, args.max_error);
        let points = sweep_scene(&sweep, &scene.name, &cases, args.shard, stem, quiet)?;
        let bar = progress_bar(quiet, 1);
        measure_left_out(
            scene,
            &points,
            &cache_dir(),
            &PictureFolder::of(folder),
            &mut || bar.set_message("reference, all bounces"),
        )
        .map_err(failed)?;
        bar.finish_and_clear();
        sections.push(Section::new(
            points,
            Some(source.to_string_lossy().into_owned()),
        ));
    }
    if args.shard.is_some() {
        Ok(())
    } else {
        write_sections(&sections, &stems, &troubles, folder, quiet)
    }
}

/// What `lumivox stress` found.
fn troubles(args: &Args, output: &Path) -> Result<Troubles, CliError> {
    let folder = args.stress.clone().unwrap_or_else(|| output.join("stress"));
    let troubles = Troubles::read(&folder).map_err(CliError::input)?;
    if args.stress.is_some() && troubles.is_empty() {
        return Err(CliError::input(format!(
            "there are no records (*.jsonl) of lumivox stress in {}; name the folder of its -o",
            folder.display()
        )));
    }
    Ok(troubles)
}

fn list(args: &Args) -> Result<(), CliError> {
    for case in grid(args.grid.as_deref())? {
        let settings: Vec<String> = case
            .settings
            .iter()
            .map(|(name, value)| format!("{name}={}", crate::measure::table::value_text(&value)))
            .collect();
        let preset = case
            .preset
            .map(|preset| format!(" {preset}"))
            .unwrap_or_default();
        say(&format!(
            "{}{preset}: {}",
            case.entry.name,
            settings.join(" ")
        ));
    }
    Ok(())
}

/// The cases of a grid's file, or of the default grid.
pub(super) fn grid(path: Option<&Path>) -> Result<Vec<Case>, CliError> {
    let Some(path) = path else {
        return grid_cases("the default grid", DEFAULT_GRID).map_err(CliError::failed);
    };
    let text = std::fs::read_to_string(path).map_err(|error| {
        CliError::input(format!(
            "cannot read the grid {}: {error}; name a file as docs/chart.md describes it",
            path.display()
        ))
    })?;
    grid_cases(&path.display().to_string(), &text).map_err(CliError::input)
}

/// The files of records in a folder, shards last. If a point has several records, the first one
/// counts; shards may have slowed each other down.
fn shards_last(folder: &Path) -> Result<Vec<PathBuf>, CliError> {
    let mut files = record_files::<Point>(folder).map_err(CliError::input)?;
    files.sort_by_key(|path| is_shard(path));
    Ok(files)
}

fn is_shard(path: &Path) -> bool {
    path.file_stem()
        .is_some_and(|stem| stem.to_string_lossy().contains("-shard-"))
}

/// Measures the cases of a scene (or of its shard) that have no record, and returns the points of
/// all.
fn sweep_scene(
    sweep: &Sweep<'_>,
    name: &str,
    cases: &[Case],
    shard: Option<Shard>,
    stem: &Path,
    quiet: bool,
) -> Result<Vec<Point>, CliError> {
    let (cases, stem): (Vec<Case>, PathBuf) = match shard {
        None => (cases.to_vec(), stem.to_owned()),
        Some(Shard { index, count }) => (
            cases
                .iter()
                .skip(index - 1)
                .step_by(count)
                .cloned()
                .collect(),
            chart_stem(stem, &format!("shard-{index}-of-{count}")),
        ),
    };
    let mut records = Records::open(&stem.with_extension("jsonl")).map_err(CliError::failed)?;
    stop::keeps("the points that were measured are kept; the same command measures the others");
    let missing = sweep.missing(&cases, &records);
    if !quiet {
        say(&format!(
            "{name}: {}, {} to measure, {} from the records",
            counted(cases.len(), "point"),
            missing.len(),
            cases.len() - missing.len()
        ));
    }
    let bar = progress_bar(quiet, 0);
    let mut progress = |step: Progress<'_>| match step {
        Progress::Reference(bounces) => {
            bar.set_message(format!("reference, {}", bounces_text(bounces)))
        }
        Progress::Case(case) => bar.set_message(case.entry.name),
        Progress::Begin(count) => bar.inc_length(count as u64),
        Progress::Refused => bar.inc(1),
        Progress::Done(point) => {
            point.failure.iter().for_each(|failure| {
                bar.suspend(|| log::warn!("{} {}: {failure}", point.name(), point.changes_text()))
            });
            bar.inc(1);
        }
    };
    let folder = stem.parent().unwrap_or(Path::new("."));
    sweep
        .measure(
            &cases,
            &cache_dir(),
            &mut records,
            &PictureFolder::of(folder),
            &mut progress,
        )
        .map_err(failed)?;
    bar.finish_and_clear();
    Ok(sweep.points(&cases, &records))
}

/// What a sweep that cannot go on is to the user.
pub(super) fn failed(error: SweepError) -> CliError {
    match error {
        SweepError::Reference(_) => CliError::input(error),
        _ => CliError::failed(error),
    }
}

/// Gathers the records and pictures of folders in one.
fn merge(
    folders: &[PathBuf],
    troubles: &Troubles,
    output: &Path,
    quiet: bool,
) -> Result<(), CliError> {
    let mut points: Vec<(Point, &PathBuf)> = Vec::new();
    for folder in folders {
        for file in shards_last(folder)? {
            let read = read_records::<Point>(&file).map_err(CliError::input)?;
            points.extend(newest(read).into_iter().map(|point| (point, folder)));
        }
    }
    if points.is_empty() {
        return Err(CliError::input(
            "there are no records (*.jsonl) in the folders of --merge",
        ));
    }
    make_folder(output)?;
    let pictures = PictureFolder::of(output);
    for (point, folder) in &points {
        for key in [&point.key, &point.setup.reference_key(point.bounces)] {
            pictures
                .copy(&PictureFolder::of(folder), key)
                .map_err(CliError::failed)?;
        }
    }
    let mut sections = Section::sort(points.iter().map(|(point, _)| point.clone()));
    // A scene may have several setups. The one with the last record is the newest: it comes first.
    sections.sort_by_key(|section| {
        let Point { scene, setup, .. } = &section.points[0];
        let first_of_scene = points.iter().position(|(point, _)| point.scene == *scene);
        (
            first_of_scene,
            Reverse(
                points
                    .iter()
                    .rposition(|(point, _)| point.scene == *scene && point.setup == *setup),
            ),
        )
    });
    let stems = stems(
        sections
            .iter()
            .flat_map(|section| section.points.first())
            .map(|point| point.scene.as_str()),
        output,
    );
    let mut known: BTreeSet<(String, u32)> = BTreeSet::new();
    for file in shards_last(output)?.iter().filter(|file| !is_shard(file)) {
        known.extend(
            read_records::<Point>(file)
                .map_err(CliError::input)?
                .into_iter()
                .map(|point| (point.key().to_owned(), point.round())),
        );
    }
    for (section, stem) in sections.iter().zip(&stems) {
        let mut records = Records::open(&stem.with_extension("jsonl")).map_err(CliError::failed)?;
        // As they were measured, unless they stand in the folder already.
        let of_section = |key: &str| section.points.iter().any(|point| point.key == key);
        for (point, _) in points.iter().filter(|(point, _)| of_section(&point.key)) {
            if known.insert((point.key.clone(), point.round())) {
                records.add(point).map_err(CliError::failed)?;
            }
        }
    }
    write_sections(&sections, &stems, troubles, output, quiet)
}

/// Tables and charts of each section, the page of all, and the answers on the terminal.
fn write_sections(
    sections: &[Section],
    stems: &[PathBuf],
    troubles: &Troubles,
    folder: &Path,
    quiet: bool,
) -> Result<(), CliError> {
    for (section, stem) in sections.iter().zip(stems) {
        write_text(&stem.with_extension("csv"), &section.csv())?;
        for cost in Cost::ALL {
            if let Some(chart) = section.chart(cost) {
                chart
                    .write(&chart_stem(stem, cost.file_suffix()))
                    .map_err(CliError::failed)?;
            }
        }
        if !quiet {
            let name = section
                .points
                .first()
                .map_or("", |point| point.scene.as_str());
            section
                .answer_lines()
                .iter()
                .for_each(|line| say(&format!("{name}: {line}")));
        }
    }
    let path = folder.join("chart.html");
    write_text(
        &path,
        &page(sections, &PictureFolder::of(folder), troubles).map_err(CliError::failed)?,
    )?;
    if !quiet {
        say(&format!(
            "{}: what to take, what will go wrong, charts, pictures and all points; open it in a \
             browser",
            path.display()
        ));
    }
    Ok(())
}

fn parse_shard(text: &str) -> Result<Shard, String> {
    let parts = text.split_once('/').and_then(|(index, count)| {
        Some(Shard {
            index: index.parse().ok()?,
            count: count.parse().ok()?,
        })
    });
    parts
        .filter(|shard| (1..=shard.count).contains(&shard.index))
        .ok_or_else(|| String::from("write i/n, with i from 1 to n, as in 2/4"))
}
