//! `lumivox stress`: where techniques break.

use std::fs::File;
use std::io::Write as _;
use std::path::{Path, PathBuf};

use lumivox::frame::FrameSettings;
use lumivox::gi::registry::{Entry, TECHNIQUES, find};
use lumivox::graph::{Gpu, GpuOptions};
use lumivox::measure::bench::{Case, cases};
use lumivox::measure::stress::{CASES, Record, StressCase};

use super::CliError;
use super::common::{DeviceArgs, ShadowArgs, check_output_folder, parse_size, progress_bar, say};

/// Measure failure modes: each a parameter from harmless to fatal, one figure for each technique and each setting that matters.
#[derive(clap::Args)]
pub(crate) struct Args {
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
    /// The setting `resolution` of techniques that have it (voxels).
    #[arg(long, value_name = "N", default_value_t = 64)]
    resolution: u32,
    /// One setting, on top of every preset; may be repeated.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// The presets alone, without one change of a setting each.
    #[arg(long)]
    no_changes: bool,
    /// Width and height (px).
    #[arg(long, value_name = "WxH", default_value = "64x48", value_parser = parse_size)]
    size: (u32, u32),
    #[command(flatten)]
    shadow: ShadowArgs,
    #[command(flatten)]
    device: DeviceArgs,
    /// The folder for CASE.jsonl, CASE.csv, CASE.md and the charts CASE-*.svg and CASE-*.png.
    #[arg(short, long, value_name = "DIR", required_unless_present = "list")]
    output: Option<PathBuf>,
}

/// Measures case by case.
pub(crate) fn run(args: &Args, quiet: bool) -> Result<(), CliError> {
    let Some(output) = args.output.as_ref().filter(|_| !args.list) else {
        CASES.iter().for_each(|case| say(&format!("{}: {} [{}; {}]", case.name, case.help, case.severity, case.source)));
        return Ok(());
    };
    let chosen = chosen(&args.case)?;
    let named: Vec<&'static Entry> = args.technique.iter().map(|name| find(name)).collect::<Result<_, _>>().map_err(CliError::input)?;
    let techniques = if named.is_empty() { TECHNIQUES } else { named.as_slice() };
    let presets = cases(techniques, &args.preset, &[args.resolution], &args.set).map_err(CliError::input)?;
    check_output_folder(output)?;
    std::fs::create_dir_all(output).map_err(|error| CliError::failed(format!("cannot make the folder {}: {error}; name another with -o", output.display())))?;
    let gpu = Gpu::new(&GpuOptions { device: args.device.choice(), ..GpuOptions::default() }).map_err(CliError::failed)?;
    chosen.into_iter().try_for_each(|case| stress(args, case, &presets, &gpu, &output.join(case.name), quiet))
}

fn chosen(names: &[String]) -> Result<Vec<&'static StressCase>, CliError> {
    if names.is_empty() {
        return Ok(CASES.to_vec());
    }
    let known = || CASES.iter().map(|case| case.name).collect::<Vec<_>>().join(", ");
    let find = |name: &String| CASES.iter().copied().find(|case| case.name == name);
    names.iter().map(|name| find(name).ok_or_else(|| CliError::input(format!("there is no failure mode {name}; there are: {}", known())))).collect()
}

fn stress(args: &Args, case: &StressCase, presets: &[Case], gpu: &Gpu, stem: &Path, quiet: bool) -> Result<(), CliError> {
    let frame = FrameSettings { size: [args.size.0, args.size.1], shadow_resolution: args.shadow.shadow_resolution };
    let unwritten = |path: &Path, error: std::io::Error| CliError::failed(format!("cannot write {}: {error}", path.display()));
    let mut runs = Vec::new();
    for preset in presets {
        let variants = case.variants(preset.entry, &preset.settings).map_err(CliError::input)?;
        runs.extend(variants.into_iter().take(if args.no_changes { 1 } else { usize::MAX }).map(|variant| (preset, variant)));
    }
    let path = stem.with_extension("jsonl");
    let mut file = File::create(&path).map_err(|error| unwritten(&path, error))?;
    let bar = progress_bar(quiet, runs.len() * case.severities.len());
    let mut records: Vec<Record> = Vec::new();
    for (preset, variant) in &runs {
        bar.set_message(if variant.0.is_empty() { preset.entry.name.to_owned() } else { variant.0.clone() });
        for severity in case.severities {
            let record = case.record(gpu, preset, variant, frame, *severity).map_err(CliError::failed)?;
            // One line at a time, so that a run that is stopped keeps what it has.
            let line = serde_json::to_string(&record).map_err(CliError::failed)?;
            writeln!(file, "{line}").map_err(|error| unwritten(&path, error))?;
            records.push(record);
            bar.inc(1);
        }
    }
    bar.finish_and_clear();
    for (extension, text) in [("csv", case.csv(&records)), ("md", format!("# {}\n\n{}", case.name, case.table(&records)))] {
        let path = stem.with_extension(extension);
        std::fs::write(&path, text).map_err(|error| unwritten(&path, error))?;
    }
    for (name, chart) in case.charts(&records) {
        chart.write(&stem.with_file_name(format!("{}-{name}", case.name))).map_err(CliError::failed)?;
    }
    if !quiet {
        say(&case.table(&records));
    }
    Ok(())
}
