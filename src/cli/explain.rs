//! `lumivox explain`: where the error of a technique comes from.

use std::path::PathBuf;

use crate::graph::{Gpu, GpuOptions};
use crate::measure::bench::Case;
use crate::measure::explain::{Budget, ExplainError, Row, Step, Subject, explain};
use crate::measure::report::Timing;
use crate::metrics::Channel;
use crate::reference::Bounces;
use crate::render::GpuScene;
use crate::text::counted;

use super::CliError;
use super::common::{
    DeviceArgs, SceneArgs, TechniqueArgs, TimingArgs, parse_channel, parse_size, progress_bar, say,
};
use super::compared::{check_max_error, reference};
use super::files::Files;
use super::frame::FrameArgs;
use super::suited::{Chosen, Suiting};
use super::write::write_report;

/// Split the error of a technique into its sources: replace one approximation at a time by the
/// truth, or by a better one, and measure the error again.
#[derive(clap::Args)]
#[command(after_help = "Example:\n\
\x20 lumivox explain bundled:cornell --technique svo")]
pub(crate) struct Args {
    /// Width and height (px).
    #[arg(long, value_name = "WxH", default_value = "160x120", value_parser = parse_size)]
    size: (u32, u32),
    /// Sample the reference until the standard error of 8x8-pixel means is below this, relative to
    /// the mean.
    #[arg(long, value_name = "X", default_value_t = 0.01)]
    max_error: f64,
    /// Compare luminance, or red, green and blue.
    #[arg(
        long,
        value_name = "luminance|rgb",
        default_value = "luminance",
        value_parser = parse_channel,
    )]
    channel: Channel,
    /// Write the table, and the report of the technique as it is, as JSON.
    #[arg(long, value_name = "FILE.json")]
    report: Option<PathBuf>,
    #[command(flatten)]
    scene: SceneArgs,
    #[command(flatten)]
    technique: TechniqueArgs,
    #[command(flatten)]
    frame: FrameArgs,
    #[command(flatten)]
    device: DeviceArgs,
    #[command(flatten)]
    timing: TimingArgs,
}

/// Renders, replaces, compares, prints.
pub(crate) fn run(args: &Args, quiet: bool) -> Result<(), CliError> {
    check_max_error(args.max_error)?;
    let mut files = Files::default();
    args.report
        .iter()
        .try_for_each(|path| files.write(path, &["json"]))?;
    let (entry, settings) = args.technique.choose([])?;
    let scene = args.scene.open(&mut files)?;
    let options = args.device.options()?;
    let isolate_passes = args.timing.choice(&options)? == Timing::Host;
    let bounces = (entry.bounces)(&settings).map_or(Bounces::Full, Bounces::Count);
    let references = if bounces == Bounces::Full { 1 } else { 2 };
    let bar = progress_bar(quiet, references);
    bar.set_message("reference");
    let truth = reference(&scene, args.size.into(), bounces, (args.max_error, None))?;
    bar.inc(1);
    // What is left out is large, and paths without end are dear.
    let all = (bounces != Bounces::Full)
        .then(|| {
            reference(
                &scene,
                args.size.into(),
                Bounces::Full,
                (4.0 * args.max_error, None),
            )
        })
        .transpose()?;
    let all = all.and_then(|all| all.image).map(|(image, _)| image);
    let gpu = Gpu::new(&GpuOptions {
        isolate_passes,
        ..options
    })
    .map_err(CliError::failed)?;
    let gpu_scene = GpuScene::new(&gpu, &scene).map_err(CliError::failed)?;
    let Chosen {
        settings,
        frame,
        suited,
    } = Suiting {
        technique: &args.technique,
        frame: &args.frame,
        size: args.size.into(),
        quiet,
    }
    .of((entry, settings), &gpu, (&gpu_scene, &scene))?;
    drop(gpu_scene);
    let case = Case {
        entry,
        preset: args.technique.preset(entry),
        settings,
    };
    let subject = Subject {
        gpu: &gpu,
        scene: &scene,
        case: &case,
        frame,
        channel: args.channel,
        truth: &truth,
    };
    let progress = |step: Step<'_>| {
        bar.set_message(step.name.to_owned());
        bar.set_length((references + step.rows) as u64);
        bar.set_position((references + step.done) as u64);
    };
    let mut budget = explain(&subject, all.as_ref(), &progress).map_err(|error| match error {
        ExplainError::Reference(error) => CliError::input(error),
        other => CliError::failed(other),
    })?;
    bar.finish_and_clear();
    budget.report.suited = suited;
    print(&budget);
    match &args.report {
        Some(path) => write_report(
            path,
            &serde_json::to_value(&budget).map_err(CliError::failed)?,
        ),
        None => Ok(()),
    }
}

fn print(budget: &Budget) {
    if let Some(error) = &budget.report.error {
        let pixels = format!(
            "{} (no 8x8 of them lie on one plane and material)",
            counted(error.pixel.count, "pixel")
        );
        say(&format!(
            "errors over {}",
            error.block.map_or(pixels, |block| format!(
                "{} of 8x8 pixels on one plane and material",
                counted(block.count, "block")
            ))
        ));
    }
    let width = budget
        .budget
        .iter()
        .map(|row| row.name.chars().count())
        .max()
        .unwrap_or(0);
    say(&format!(
        "{:width$} {:>9} {:>9} {:>9} {:>9}  by",
        "replaced", "bias", "rel_rmse", "explains", "frame ms"
    ));
    budget.budget.iter().for_each(|row| say(&line(row, width)));
    print_materials(budget);
    if let Some(left_out) = &budget.left_out {
        let (bias, rel_rmse) = (left_out.bias, left_out.rel_rmse);
        say(&format!(
            "the reference at this bounce count lacks the light of further bounces: bias \
             {bias:+.4}, rel_rmse {rel_rmse:.4}; only --set bounces=… adds it"
        ));
    }
    let advice = budget
        .budget
        .iter()
        .filter(|row| !row.options.is_empty() && row.explains.is_some_and(|it| it >= LEAST_GAIN));
    match advice.max_by(|a, b| {
        a.explains
            .unwrap_or(0.0)
            .total_cmp(&b.explains.unwrap_or(0.0))
    }) {
        Some(row) => say(&format!(
            "the setting that gains most is {}: {}",
            row.name,
            row.options.join(" ")
        )),
        None => say("no better setting gains anything"),
    }
}

/// What takes less of the squared error away gains nothing.
const LEAST_GAIN: f64 = 0.005;

/// Materials of fewer pixels than this share have no line.
const LEAST_SHARE: f64 = 0.02;

/// Which material has which error, and from where.
fn print_materials(budget: &Budget) {
    let materials = budget.by_material(LEAST_SHARE);
    if materials.len() < 2 {
        return;
    }
    let widths = materials.iter().map(|it| it.material.chars().count());
    let width = widths.max().unwrap_or(0).max("material".len());
    say(&format!(
        "{:width$} {:>9} {:>9} {:>9}  explained most by",
        "material", "bias", "rel_rmse", "pixels"
    ));
    for it in materials {
        let source = match it.source.filter(|(_, share)| *share >= LEAST_GAIN) {
            Some((name, share)) => format!("{name} ({:.0}%)", 100.0 * share),
            None => "nothing".to_owned(),
        };
        say(&format!(
            "{:width$} {:>+9.4} {:>9.4} {:>8.0}%  {source}",
            it.material,
            it.error.bias,
            it.error.rel_rmse,
            100.0 * it.pixels
        ));
    }
}

fn line(row: &Row, width: usize) -> String {
    let Row {
        name,
        help,
        options,
        error,
        explains,
        frame_ms,
        failure,
        ..
    } = row;
    if let Some(failure) = failure {
        return format!("{name:width$} {failure}");
    }
    let number =
        |value: Option<f64>, write: fn(f64) -> String| value.map_or_else(|| "-".to_owned(), write);
    let by = if options.is_empty() {
        help.clone()
    } else {
        format!("{help} ({})", options.join(" "))
    };
    format!(
        "{name:width$} {:>9} {:>9} {:>9} {:>9}  {by}",
        number(error.map(|error| error.bias), |bias| format!("{bias:+.4}")),
        number(error.map(|error| error.rel_rmse), |rel_rmse| format!(
            "{rel_rmse:.4}"
        )),
        number(*explains, |share| format!("{:.0}%", 100.0 * share)),
        number(*frame_ms, |ms| format!("{ms:.1}")),
    )
}
