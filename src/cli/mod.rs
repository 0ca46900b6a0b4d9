//! The command line: one file per subcommand; argument parsing and printing only.
//!
//! A program of yours that adds a technique ([`crate::gi::registry::add`]) and then calls [`run`]
//! is Lumivox with that technique.

mod bench;
mod capture;
mod chart;
mod common;
mod compare;
mod compare_frames;
mod compared;
mod devices;
mod explain;
mod files;
mod fit;
mod frame;
mod lpv;
mod measured;
mod nothing;
mod picture;
mod reference;
mod render;
mod scene;
mod sequence;
mod stop;
mod stress;
mod suited;
mod techniques;
mod view;
mod voxelize;
mod write;

use std::process::ExitCode;

use crate::graph::Messages;
use crate::text::counted;
use clap::Parser;

use self::common::{check_said, said};

/// Why a command ended without doing its work.
#[derive(Debug, thiserror::Error)]
pub(crate) enum CliError {
    /// The arguments or the input are wrong: exit code 2.
    #[error("{0}")]
    Input(Box<dyn std::error::Error + Send + Sync>),
    /// The work failed: exit code 1.
    #[error("{0}")]
    Failed(Box<dyn std::error::Error + Send + Sync>),
}

impl CliError {
    /// Bad arguments or input.
    pub(crate) fn input(error: impl Into<Box<dyn std::error::Error + Send + Sync>>) -> Self {
        CliError::Input(error.into())
    }

    /// Work that failed although its input was good.
    pub(crate) fn failed(error: impl Into<Box<dyn std::error::Error + Send + Sync>>) -> Self {
        CliError::Failed(error.into())
    }
}

/// Real-time global illumination techniques side by side, measured against ground truth.
#[derive(Parser)]
#[command(version, about)]
struct Cli {
    #[command(subcommand)]
    command: Command,
    /// Print errors only: no warnings, no progress.
    #[arg(long, global = true)]
    quiet: bool,
}

#[derive(clap::Subcommand)]
enum Command {
    Render(Box<render::Args>),
    Bench(Box<bench::Args>),
    Chart(Box<chart::Args>),
    Scene(scene::Args),
    Techniques(techniques::Args),
    Reference(reference::Args),
    Compare(compare::Args),
    Explain(Box<explain::Args>),
    Fit(Box<fit::Args>),
    Stress(Box<stress::Args>),
    Lpv(Box<lpv::Args>),
    View(Box<view::Args>),
    Voxelize(voxelize::Args),
    Devices(devices::Args),
}

/// Parses the command line, runs the subcommand, and says in one line (then one per cause) what
/// went wrong. Exit codes: 0 done, 1 the work failed, 2 bad arguments or input.
pub fn run() -> ExitCode {
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(error) => {
            said(error.print());
            return end(check_said().err(), error.exit_code());
        }
    };
    stop::listen();
    let level = if cli.quiet {
        log::LevelFilter::Error
    } else {
        log::LevelFilter::Warn
    };
    env_logger::Builder::new()
        .filter_level(level)
        .format_timestamp(None)
        .format_target(false)
        .init();
    let result = match cli.command {
        Command::Render(args) => render::run(&args, cli.quiet),
        Command::Bench(args) => bench::run(&args, cli.quiet),
        Command::Chart(args) => chart::run(&args, cli.quiet),
        Command::Scene(args) => scene::run(&args),
        Command::Techniques(args) => techniques::run(&args),
        Command::Reference(args) => reference::run(&args, cli.quiet),
        Command::Compare(args) => compare::run(&args),
        Command::Explain(args) => explain::run(&args, cli.quiet),
        Command::Fit(args) => fit::run(&args, cli.quiet),
        Command::Stress(args) => stress::run(&args, cli.quiet),
        Command::Lpv(args) => lpv::run(&args, cli.quiet),
        Command::View(args) => view::run(&args),
        Command::Voxelize(args) => voxelize::run(&args, cli.quiet),
        Command::Devices(args) => devices::run(&args),
    };
    let error = result
        .and_then(|()| validated())
        .and_then(|()| check_said())
        .err();
    end(error, 0)
}

/// Tells an error, or ends with a code where there is none.
fn end(error: Option<CliError>, code: i32) -> ExitCode {
    let Some(error) = error else {
        return ExitCode::from(u8::try_from(code).unwrap_or(1));
    };
    eprintln!("error: {error}");
    let mut cause = match &error {
        CliError::Input(inner) | CliError::Failed(inner) => inner.source(),
    };
    while let Some(inner) = cause {
        // Some messages quote their cause.
        if !error.to_string().contains(&inner.to_string()) {
            eprintln!("  caused by: {inner}");
        }
        cause = inner.source();
    }
    ExitCode::from(if matches!(error, CliError::Input(_)) {
        2
    } else {
        1
    })
}

/// Fails if the validation layer had any message about a device of this run, from its opening to
/// its end.
fn validated() -> Result<(), CliError> {
    match Messages::of_process().as_slice() {
        [] => Ok(()),
        messages @ [first, ..] => Err(CliError::failed(format!(
            "{}, the first: {first}",
            counted(messages.len(), "validation message")
        ))),
    }
}
