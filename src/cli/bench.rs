//! `lumivox bench`: time, memory and error of techniques, presets and resolutions.

use std::collections::BTreeMap;
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::time::Duration;

use crate::gi::entry::Entry;
use crate::gi::registry::{DEFAULT, find};
use crate::measure::bench::{BenchSettings, Case, Truth, cases, measure, on_cpu};
use crate::measure::draw::Chart;
use crate::measure::records::{Records, line_of, read_records, record_files};
use crate::measure::report::Report;
use crate::measure::throughput;
use crate::measure::walk::{self, WalkSettings};
use crate::measure::{
    directions_chart, error_chart, memory_chart, motion_chart, passes_chart, stages_chart,
    structures_chart, table, walk_chart,
};
use crate::metrics::Channel;
use crate::reference::{Bounces, guide};
use crate::scene::Scene;

use super::CliError;
use super::common::{
    DeviceArgs, LoadArgs, TimingArgs, bad_setting, parse_channel, parse_seconds, parse_size,
    progress_bar, say, warn_of_idle_in,
};
use super::compared::{ComparedArgs, check_max_error, reference};
use super::files::check_results_folder;
use super::frame::FrameArgs;
use super::stop;
use super::write::{chart_stem, check_output, check_output_folder, make_folder, stems, write_text};

/// Measure techniques, presets and resolutions: time per pass, memory, error against the
/// path-traced reference.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n\
\x20 lumivox bench bundled:cornell --technique svo --preset accurate,textbook -o out\n\
\x20 lumivox bench --merge out -o tables")]
pub(crate) struct Args {
    /// `bundled:NAME`, or the path of a .toml, .obj, .gltf or .glb file.
    #[arg(required_unless_present = "merge")]
    scene: Vec<OsString>,
    /// Techniques; `lumivox techniques` lists them.
    #[arg(
        long,
        value_name = "NAME,…",
        value_delimiter = ',',
        default_value = DEFAULT
    )]
    technique: Vec<String>,
    /// Presets of each technique [default: its default preset].
    #[arg(long, value_name = "NAME,…", value_delimiter = ',')]
    preset: Vec<String>,
    /// Values of the setting `resolution` (cells) [default: each preset's own].
    #[arg(long, value_name = "N,…", value_delimiter = ',')]
    resolution: Vec<u32>,
    /// One setting, on top of every preset; may be repeated.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Frames to measure, after one that warms up (16 with `bounces=feedback`), and on a GPU after
    /// 0.4 s that raise its clocks [default: 5 on a CPU device, 100 elsewhere].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=100_000))]
    frames: Option<u32>,
    /// Go on with frames until so long has gone by (s).
    #[arg(long, value_name = "SECONDS", value_parser = parse_seconds)]
    seconds: Option<Duration>,
    /// Builds of the static structure to measure, after the first.
    #[arg(
        long,
        value_name = "N",
        default_value_t = 5,
        value_parser = clap::value_parser!(u32).range(1..=100_000),
    )]
    rebuilds: u32,
    /// Times (s) of the models with keyframes; at each, the update of the structure is measured as
    /// often as --rebuilds says.
    #[arg(
        long,
        value_name = "T,…",
        value_delimiter = ',',
        allow_negative_numbers = true
    )]
    times: Vec<f32>,
    /// Let the camera walk along its view, there and back through the scene, for this many frames
    /// at each speed.
    #[arg(long, value_name = "FRAMES", value_parser = clap::value_parser!(u32).range(1..=100_000))]
    walk: Option<u32>,
    /// Speeds of --walk (finest cells of each technique, a frame).
    #[arg(
        long,
        value_name = "V,…",
        value_delimiter = ',',
        default_value = "0,0.25,1,4,16",
        requires = "walk"
    )]
    speeds: Vec<f32>,
    /// Count frames a second for so long (s), and as long with frames in flight.
    #[arg(long, value_name = "SECONDS", value_parser = parse_seconds)]
    throughput: Option<Duration>,
    /// Width and height (px).
    #[arg(long, value_name = "WxH", default_value = "256x256", value_parser = parse_size)]
    size: (u32, u32),
    /// Render no reference, and measure no errors.
    #[arg(long)]
    no_reference: bool,
    /// Sample the reference until the standard error of 8x8-pixel means is below this, relative to
    /// the mean.
    #[arg(
        long,
        value_name = "X",
        default_value_t = 0.01,
        conflicts_with = "no_reference"
    )]
    max_error: f64,
    /// Compare luminance, or red, green and blue.
    #[arg(
        long,
        value_name = "luminance|rgb",
        default_value = "luminance",
        value_parser = parse_channel,
    )]
    channel: Channel,
    #[command(flatten)]
    compared: ComparedArgs,
    /// Measure nothing: gather the records of these folders, those of equal file names together,
    /// and draw their tables and charts.
    #[arg(long, value_name = "DIR", num_args = 1.., conflicts_with = "scene")]
    merge: Vec<PathBuf>,
    /// The folder for each scene's records NAME-bench.jsonl, table NAME-bench.csv and charts
    /// NAME-bench-*.svg and .png. Records are added to those that are there; table and charts show
    /// this run.
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    #[command(flatten)]
    frame: FrameArgs,
    #[command(flatten)]
    device: DeviceArgs,
    #[command(flatten)]
    timing: TimingArgs,
    #[command(flatten)]
    load: LoadArgs,
}

/// Loads everything, then measures case by case.
pub(crate) fn run(args: &Args, quiet: bool) -> Result<(), CliError> {
    if !args.merge.is_empty() {
        return merge(&args.merge, &args.output, quiet);
    }
    check_max_error(args.max_error)?;
    if let Some(time_s) = args.times.iter().find(|time_s| !time_s.is_finite()) {
        return Err(CliError::input(format!(
            "--times has {time_s}; it must be a number of seconds"
        )));
    }
    if let Some(speed) = args
        .speeds
        .iter()
        .find(|speed| !(speed.is_finite() && **speed >= 0.0))
    {
        return Err(CliError::input(format!(
            "--speeds has {speed}; it must be a number of cells, 0 or more"
        )));
    }
    let techniques: Vec<&'static Entry> = args
        .technique
        .iter()
        .map(|name| find(name))
        .collect::<Result<_, _>>()
        .map_err(CliError::input)?;
    let cases =
        cases(&techniques, &args.preset, &args.resolution, &args.set).map_err(bad_setting)?;
    warn_of_idle_in(&cases, &args.set);
    check_output_folder(&args.output)?;
    let options = args.load.options();
    let scenes: Vec<Scene> = args
        .scene
        .iter()
        .map(|scene| Scene::open(scene, &options))
        .collect::<Result<_, _>>()
        .map_err(CliError::input)?;
    check_results_folder(&args.output, &scenes)?;
    // `chart` has records of the same scene, without this suffix.
    let stems: Vec<PathBuf> = stems(scenes.iter().map(|scene| scene.name.as_str()), &args.output)
        .iter()
        .map(|stem| chart_stem(stem, "bench"))
        .collect();
    stems
        .iter()
        .flat_map(|stem| outputs(stem))
        .filter(|path| path.exists())
        .try_for_each(|path| check_output(&path))?;
    let gpu = args.device.options()?;
    let default_frames = if on_cpu(&gpu).map_err(CliError::failed)? {
        5
    } else {
        100
    };
    let timing = args.timing.choice(&gpu)?;
    let frame = args.frame.settings(args.size);
    let times = args.times.clone();
    let walk = args.walk.map(|frames| WalkSettings {
        speeds: args.speeds.clone(),
        frames,
    });
    let settings = BenchSettings {
        gpu,
        timing,
        frame,
        warm_up: true,
        frames: args.frames.unwrap_or(default_frames),
        at_least: args.seconds.unwrap_or_default(),
        rebuilds: args.rebuilds,
        times,
        still: true,
        walk,
        throughput: args.throughput,
        samples: true,
        channel: args.channel,
        visibility: args.compared.visibility()?,
    };
    make_folder(&args.output)?;
    scenes
        .iter()
        .zip(&stems)
        .try_for_each(|(scene, stem)| bench_scene(args, scene, &cases, &settings, stem, quiet))
}

/// Every file that a scene's benchmark may write.
fn outputs(stem: &Path) -> Vec<PathBuf> {
    let charts = CHARTS.iter().flat_map(|(what, _)| {
        ["svg", "png"].map(|extension| chart_stem(stem, what).with_extension(extension))
    });
    ["jsonl", "csv"]
        .map(|extension| stem.with_extension(extension))
        .into_iter()
        .chain(charts)
        .collect()
}

/// What follows the scene's name in a chart's file name, and what draws it.
type NamedChart = (&'static str, fn(&[Report]) -> Option<Chart>);

static CHARTS: &[NamedChart] = &[
    ("error", error_chart),
    ("passes", passes_chart),
    ("memory", memory_chart),
    ("stages", stages_chart),
    ("structures", structures_chart),
    ("directions", directions_chart),
    ("motion", motion_chart),
    ("walk", walk_chart),
];

fn bench_scene(
    args: &Args,
    scene: &Scene,
    cases: &[Case],
    settings: &BenchSettings,
    stem: &Path,
    quiet: bool,
) -> Result<(), CliError> {
    let mut records = Records::open(&stem.with_extension("jsonl")).map_err(CliError::failed)?;
    stop::keeps(
        "the cases that were measured are in the records; --merge draws their tables and charts",
    );
    let bar = progress_bar(quiet, cases.len());
    if !quiet {
        say(&format!("{}: {}", scene.name, table::LEGEND));
        say(&table::heading());
    }
    let mut truths: Vec<(Bounces, Truth)> = Vec::new();
    let mut reports: Vec<Report> = Vec::new();
    for case in cases {
        let bounces = (case.entry.bounces)(&case.settings).map_or(Bounces::Full, Bounces::Count);
        if !truths.iter().any(|(known, _)| *known == bounces) {
            bar.set_message("reference");
            truths.push((bounces, truth(args, scene, bounces)?));
        }
        bar.set_message(case.entry.name);
        let Some((_, truth)) = truths.iter().find(|(known, _)| *known == bounces) else {
            continue;
        };
        let report = measure(scene, case, settings, truth).map_err(CliError::failed)?;
        // One line at a time, so that a run that is stopped keeps what it has.
        records.add(&report).map_err(CliError::failed)?;
        if !quiet {
            bar.suspend(|| {
                std::iter::once(table::row(&report))
                    .chain(walk::lines(&report))
                    .chain(throughput::lines(&report))
                    .for_each(|line| say(&line))
            });
        }
        bar.inc(1);
        reports.push(report);
    }
    bar.finish_and_clear();
    write_tables(&reports, stem)
}

/// The table and the charts of a scene's reports.
fn write_tables(reports: &[Report], stem: &Path) -> Result<(), CliError> {
    write_text(&stem.with_extension("csv"), &table::csv(reports))?;
    CHARTS
        .iter()
        .filter_map(|(what, chart)| Some((what, chart(reports)?)))
        .try_for_each(|(what, chart)| {
            let written = chart.write(&chart_stem(stem, what));
            written.map(drop).map_err(CliError::failed)
        })
}

/// Gathers the records of folders in one, and draws what they say.
fn merge(folders: &[PathBuf], output: &Path, quiet: bool) -> Result<(), CliError> {
    check_output_folder(output)?;
    let mut reports: BTreeMap<OsString, Vec<Report>> = BTreeMap::new();
    for folder in folders {
        for file in record_files::<Report>(folder).map_err(CliError::input)? {
            let name = file.file_name().unwrap_or_default().to_owned();
            let known = reports.entry(name).or_default();
            for report in read_records::<Report>(&file).map_err(CliError::input)? {
                // What was measured again counts as it was measured last.
                match known.iter_mut().find(|known| known.is_same_case(&report)) {
                    Some(known) => *known = report,
                    None => known.push(report),
                }
            }
        }
    }
    if reports.values().all(Vec::is_empty) {
        return Err(CliError::input(
            "there are no records (*.jsonl) in the folders of --merge",
        ));
    }
    make_folder(output)?;
    for (name, reports) in &reports {
        let records = output.join(name);
        let lines = reports
            .iter()
            .map(line_of)
            .collect::<Result<String, serde_json::Error>>()
            .map_err(CliError::failed)?;
        write_text(&records, &lines)?;
        write_tables(reports, &records.with_extension(""))?;
        if !quiet {
            say(&format!("{}: {}", records.display(), table::LEGEND));
            say(&table::heading());
            reports
                .iter()
                .flat_map(|report| std::iter::once(table::row(report)).chain(walk::lines(report)))
                .for_each(|line| say(&line));
        }
    }
    Ok(())
}

/// The reference with what each pixel sees, or only the latter.
fn truth(args: &Args, scene: &Scene, bounces: Bounces) -> Result<Truth, CliError> {
    let (width, height) = args.size;
    if args.no_reference {
        return Ok(Truth {
            guide: guide(scene, width, height).map_err(CliError::input)?,
            image: None,
        });
    }
    let visibility = args.compared.visibility()?;
    reference(
        scene,
        args.size.into(),
        bounces,
        (args.max_error, visibility),
    )
}
