//! `lumivox stress`: where techniques break.

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use crate::gi::Settings;
use crate::gi::entry::Entry;
use crate::gi::registry::{all, find};
use crate::graph::Gpu;
use crate::measure::bench::{Case, cases};
use crate::measure::records::{Records, read_records};
use crate::measure::stress::results::{Results, summary};
use crate::measure::stress::{
    CASES, Effort, LEAST_RESOLUTION, Memo, Record, StressCase, StressError, Trial,
};
use crate::reference::cache_dir;
use crate::scene::Scene;
use indicatif::ProgressBar;

use super::CliError;
use super::common::{
    DeviceArgs, LoadArgs, bad_setting, check_scenes, each_once, parse_size, progress_bar, say,
    warn_of_idle_in,
};
use super::files::check_results_folder;
use super::frame::FrameArgs;
use super::stop;
use super::write::{check_output_folder, make_folder, stems, write_text};

/// Measure failure modes. Each makes one number worse, from harmless to fatal, and measures every
/// technique.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n\
\x20 lumivox stress --list\n\
\x20 lumivox stress thin_walls --quick -o out")]
pub(crate) struct Args {
    /// `bundled:NAME`, or the path of a .toml, .obj, .gltf or .glb file, for the failure modes that
    /// take any scene [default: the suite's own, and all failure modes].
    scene: Vec<OsString>,
    /// Failure modes [default: all].
    #[arg(long, value_name = "NAME,…", value_delimiter = ',')]
    case: Vec<String>,
    /// List the failure modes and do nothing else.
    #[arg(long)]
    list: bool,
    /// Techniques [default: all]; `lumivox techniques` lists them.
    #[arg(long, value_name = "NAME,…", value_delimiter = ',')]
    technique: Vec<String>,
    /// Presets of each technique [default: its default preset].
    #[arg(long, value_name = "NAME,…", value_delimiter = ',')]
    preset: Vec<String>,
    /// The setting `resolution` of techniques that have it (cells).
    #[arg(long, value_name = "N", default_value_t = 64)]
    resolution: u32,
    /// One setting, on top of every preset; may be repeated.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Also measure each preset with one setting changed at a time, where a failure mode names
    /// settings that matter to it.
    #[arg(long)]
    changes: bool,
    /// Fewer severities, steps, frames and samples: a look within a minute or two.
    #[arg(long)]
    quick: bool,
    /// Width and height (px).
    #[arg(long, value_name = "WxH", default_value = "64x48", value_parser = parse_size)]
    size: (u32, u32),
    /// Measure nothing: gather the records of these folders, and write what they say.
    #[arg(long, value_name = "DIR", num_args = 1.., conflicts_with_all = ["scene", "case", "list"])]
    merge: Vec<PathBuf>,
    /// The folder for stress.md and each failure mode's CASE.jsonl, .csv, .md, .svg and .png. What
    /// has a record there is not measured again.
    #[arg(short, long, value_name = "DIR", required_unless_present = "list")]
    output: Option<PathBuf>,
    #[command(flatten)]
    frame: FrameArgs,
    #[command(flatten)]
    device: DeviceArgs,
    #[command(flatten)]
    load: LoadArgs,
}

/// One row of a table: a technique with settings, and the change that was made to its preset's.
struct Run<'c> {
    case: &'c Case,
    change: String,
    settings: Settings,
}

/// What all cases of one scene are measured with.
struct Suite<'a> {
    args: &'a Args,
    scene: Option<&'a Scene>,
    presets: &'a [Case],
    memo: Memo,
    bar: ProgressBar,
}

/// Measures case by case, scene by scene.
pub(crate) fn run(args: &Args, quiet: bool) -> Result<(), CliError> {
    let chosen = chosen(args)?;
    let Some(output) = args.output.as_ref().filter(|_| !args.list) else {
        chosen.iter().for_each(|case| {
            let scenes = if case.any_scene {
                "; takes any scene"
            } else {
                ""
            };
            let severities: Vec<String> = case.severities.iter().map(f64::to_string).collect();
            let severities = severities.join(", ");
            say(&format!(
                "{}: {} [{}: {severities}; {}{scenes}]",
                case.name, case.help, case.severity, case.source
            ));
        });
        return Ok(());
    };
    if !args.merge.is_empty() {
        check_output_folder(output)?;
        return merge(&args.merge, output, quiet);
    }
    let named: Vec<&'static Entry> = each_once(&args.technique)
        .iter()
        .map(|name| find(name))
        .collect::<Result<_, _>>()
        .map_err(CliError::input)?;
    let techniques = if named.is_empty() { all() } else { named };
    let presets = cases(
        &techniques,
        &each_once(&args.preset),
        &[args.resolution],
        &args.set,
    )
    .map_err(bad_setting)?;
    warn_of_idle_in(&presets, &args.set);
    if let Some(coarse) = presets
        .iter()
        .filter_map(|case| case.settings.resolution())
        .find(|resolution| *resolution < LEAST_RESOLUTION)
    {
        return Err(CliError::input(format!(
            "--resolution is {coarse}; the scenes of the suite need at least {LEAST_RESOLUTION} \
             cells"
        )));
    }
    let options = args.load.options();
    let scenes: Vec<Scene> = args
        .scene
        .iter()
        .map(|scene| Scene::open(scene, &options))
        .collect::<Result<_, _>>()
        .map_err(CliError::input)?;
    check_scenes(&scenes)?;
    check_output_folder(output)?;
    check_results_folder(output, &scenes)?;
    let mut gpu = open(args)?;
    let folders = if scenes.is_empty() {
        vec![output.clone()]
    } else {
        stems(scenes.iter().map(|scene| scene.name.as_str()), output)
    };
    let of_scene = if scenes.is_empty() {
        vec![None]
    } else {
        scenes.iter().map(Some).collect()
    };
    for (scene, folder) in of_scene.into_iter().zip(&folders) {
        check_results_folder(folder, &scenes)?;
        make_folder(folder)?;
        let rows: usize = chosen
            .iter()
            .map(|case| Ok(runs(args, case, &presets)?.len() * severities(args, case).len()))
            .sum::<Result<_, CliError>>()?;
        stop::keeps("the rows that were measured are kept; the same command measures the others");
        let suite = Suite {
            args,
            scene,
            presets: &presets,
            memo: Memo::new(cache_dir()),
            bar: progress_bar(quiet, rows),
        };
        suite.run(&mut gpu, &chosen, folder, quiet)?;
    }
    Ok(())
}

fn open(args: &Args) -> Result<Gpu, CliError> {
    Gpu::new(&args.device.options()?).map_err(CliError::failed)
}

/// The cases that are asked for; with scenes, those that take any.
fn chosen(args: &Args) -> Result<Vec<&'static StressCase>, CliError> {
    let fits = |case: &&'static StressCase| args.scene.is_empty() || case.any_scene;
    if args.case.is_empty() {
        return Ok(CASES.iter().copied().filter(fits).collect());
    }
    let known = || {
        CASES
            .iter()
            .map(|case| case.name)
            .collect::<Vec<_>>()
            .join(", ")
    };
    let find = |name: &String| {
        let case = CASES.iter().copied().find(|case| case.name == name);
        let case = case.ok_or_else(|| {
            CliError::input(format!(
                "there is no failure mode {name}; there are: {}",
                known()
            ))
        })?;
        let own = || {
            CliError::input(format!(
                "the failure mode {name} has a scene of its own; leave out the scene, or the \
                 failure mode"
            ))
        };
        Some(case).filter(fits).ok_or_else(own)
    };
    each_once(&args.case).iter().map(find).collect()
}

fn effort(args: &Args) -> &'static Effort {
    if args.quick {
        &Effort::QUICK
    } else {
        &Effort::FULL
    }
}

fn severities(args: &Args, case: &StressCase) -> &'static [f64] {
    case.severities_at(effort(args))
}

fn runs<'c>(args: &Args, case: &StressCase, presets: &'c [Case]) -> Result<Vec<Run<'c>>, CliError> {
    let mut runs = Vec::new();
    for preset in presets {
        let variants = case
            .variants(preset.entry, &preset.settings)
            .map_err(CliError::input)?;
        let count = if args.changes { variants.len() } else { 1 };
        runs.extend(
            variants
                .into_iter()
                .take(count)
                .map(|(change, settings)| Run {
                    case: preset,
                    change,
                    settings,
                }),
        );
    }
    Ok(runs)
}

impl Suite<'_> {
    fn run(
        &self,
        gpu: &mut Gpu,
        chosen: &[&'static StressCase],
        folder: &Path,
        quiet: bool,
    ) -> Result<(), CliError> {
        let mut last = None;
        for &case in chosen {
            last = self.measure(gpu, case, &folder.join(case.name))?.or(last);
            if let Some(record) = &last {
                write_case(case, &records_like(record, case, folder)?, folder)?;
            }
        }
        self.bar.finish_and_clear();
        last.map_or(Ok(()), |last| write_all(&last, chosen, folder, quiet))
    }

    /// Measures every part of a case that has no record yet, and returns the last record.
    fn measure(
        &self,
        gpu: &mut Gpu,
        case: &'static StressCase,
        stem: &Path,
    ) -> Result<Option<Record>, CliError> {
        let mut records: Records<Record> =
            Records::open(&stem.with_extension("jsonl")).map_err(CliError::failed)?;
        let mut last = None;
        for run in runs(self.args, case, self.presets)? {
            self.bar.set_message(case.name);
            for &severity in severities(self.args, case) {
                let key = Record::key_of(
                    case,
                    &self.trial(gpu, &run),
                    run.case,
                    &run.change,
                    severity,
                );
                let record = match records.find(&key) {
                    Some(record) => record.clone(),
                    None => {
                        let record = case
                            .record(&self.trial(gpu, &run), run.case, &run.change, severity)
                            .map_err(failed)?;
                        records.add(&record).map_err(CliError::failed)?;
                        if record.is_lost {
                            *gpu = open(self.args)?;
                        }
                        record
                    }
                };
                record.failure.iter().for_each(|failure| {
                    self.bar.suspend(|| {
                        log::warn!("{} of {}: {failure}", case.name, record.case_name())
                    })
                });
                last = Some(record);
                self.bar.inc(1);
            }
        }
        Ok(last)
    }

    fn trial<'p>(&'p self, gpu: &'p Gpu, run: &'p Run<'_>) -> Trial<'p> {
        Trial {
            gpu,
            entry: run.case.entry,
            settings: &run.settings,
            frame: self.args.frame.small(self.args.size),
            effort: effort(self.args),
            scene: self.scene,
            memo: &self.memo,
        }
    }
}

/// Tells whether the input or the work is to blame that nothing could be measured.
fn failed(error: StressError) -> CliError {
    match error {
        StressError::Reference(error) => CliError::input(error),
        _ => CliError::failed(error),
    }
}

/// Gathers the records of folders in one.
fn merge(folders: &[PathBuf], output: &Path, quiet: bool) -> Result<(), CliError> {
    let mut found: Vec<Record> = Vec::new();
    for folder in folders {
        let before = found.len();
        for file in CASES
            .iter()
            .map(|case| folder.join(case.name).with_extension("jsonl"))
            .filter(|file| file.is_file())
        {
            found.extend(read_records::<Record>(&file).map_err(CliError::input)?);
        }
        if found.len() == before {
            return Err(CliError::input(format!(
                "there are no records (*.jsonl) of failure modes in {}; name the folder of an -o",
                folder.display()
            )));
        }
    }
    let Some(last) = found.last() else {
        return Ok(());
    };
    make_folder(output)?;
    for case in CASES {
        let of_case: Vec<&Record> = found
            .iter()
            .filter(|record| record.case == case.name)
            .collect();
        if of_case.is_empty() {
            continue;
        }
        let mut records: Records<Record> =
            Records::open(&output.join(case.name).with_extension("jsonl"))
                .map_err(CliError::failed)?;
        for record in of_case {
            if records.find(&record.key).is_none() {
                records.add(record).map_err(CliError::failed)?;
            }
        }
    }
    for case in CASES {
        write_case(case, &records_like(last, case, output)?, output)?;
    }
    write_all(last, CASES, output, quiet)
}

/// The records of a case in a folder that can be compared with this one: same setup and scene, any
/// build. If a row has several records, only the last is kept.
fn records_like(one: &Record, case: &StressCase, folder: &Path) -> Result<Vec<Record>, CliError> {
    let path = folder.join(case.name).with_extension("jsonl");
    let records = if path.is_file() {
        read_records::<Record>(&path).map_err(CliError::input)?
    } else {
        Vec::new()
    };
    let mut rows: Vec<Record> = Vec::new();
    for record in records
        .into_iter()
        .filter(|record| record.setup.is_like(&one.setup) && record.scene_hash == one.scene_hash)
    {
        match rows.iter_mut().find(|row| row.is_same_row(&record)) {
            Some(row) => *row = record,
            None => rows.push(record),
        }
    }
    Ok(rows)
}

/// Tables and charts of one case.
fn write_case(
    case: &'static StressCase,
    records: &[Record],
    folder: &Path,
) -> Result<(), CliError> {
    if records.is_empty() {
        return Ok(());
    }
    let (results, stem) = (Results { case, records }, folder.join(case.name));
    write_text(&stem.with_extension("csv"), &results.csv())?;
    write_text(
        &stem.with_extension("md"),
        &format!("# {}\n\n{}", case.name, results.table()),
    )?;
    for (suffix, chart) in results.charts() {
        chart
            .write(&stem.with_file_name(format!("{}{suffix}", case.name)))
            .map_err(CliError::failed)?;
    }
    Ok(())
}

/// Writes the table of all records in a folder that have this record's setup and scene. The
/// terminal shows only the table of the case that was asked for, if it was a single one.
fn write_all(
    one: &Record,
    chosen: &[&'static StressCase],
    folder: &Path,
    quiet: bool,
) -> Result<(), CliError> {
    let all: Vec<(&'static StressCase, Vec<Record>)> = CASES
        .iter()
        .map(|case| Ok((*case, records_like(one, case, folder)?)))
        .collect::<Result<_, CliError>>()?;
    let results: Vec<Results<'_>> = all
        .iter()
        .filter(|(_, records)| !records.is_empty())
        .map(|(case, records)| Results { case, records })
        .collect();
    let title = one.scene.as_ref().map_or_else(
        || "Failure modes".to_owned(),
        |scene| format!("Failure modes in {scene}"),
    );
    let text = format!("# {title}\n\n{}", summary(&results));
    write_text(&folder.join("stress.md"), &text)?;
    if !quiet {
        let only = |only: &StressCase| {
            results
                .iter()
                .find(|results| results.case.name == only.name)
                .map(Results::table)
        };
        say(&chosen
            .first()
            .filter(|_| chosen.len() == 1)
            .and_then(|case| only(case))
            .unwrap_or(text));
    }
    Ok(())
}
