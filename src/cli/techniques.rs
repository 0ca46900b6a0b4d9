//! `lumivox techniques`.

use crate::gi::entry::Entry;
use crate::gi::registry::{all, find};
use crate::gi::settings::{Group, Setting};

use super::CliError;
use super::common::say;

/// List the techniques and their presets; of one, its settings with units, ranges and defaults.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n\
\x20 lumivox techniques\n\
\x20 lumivox techniques svo")]
pub(crate) struct Args {
    /// Describe this technique with all its settings [default: a table of all techniques].
    technique: Option<String>,
}

/// Prints one technique, or a table of all.
pub(crate) fn run(args: &Args) -> Result<(), CliError> {
    match &args.technique {
        Some(name) => describe(find(name).map_err(CliError::input)?),
        None => {
            print_table(&all());
            Ok(())
        }
    }
}

fn print_table(techniques: &[&Entry]) {
    let presets = |entry: &Entry| -> String {
        let names: Vec<&str> = entry.presets.iter().map(|preset| preset.name).collect();
        names.join(", ")
    };
    let rows: Vec<[String; 3]> = techniques
        .iter()
        .map(|entry| {
            [
                entry.name.to_owned(),
                presets(entry),
                entry.summary.to_owned(),
            ]
        })
        .collect();
    let width = |column: usize, heading: &str| {
        rows.iter()
            .map(|row| row[column].chars().count())
            .max()
            .unwrap_or(0)
            .max(heading.len())
    };
    let names = width(0, "technique");
    say(&format!("{:names$}  what it is", "technique"));
    for [name, presets, summary] in &rows {
        say(&format!("{name:names$}  {summary}"));
        if !presets.is_empty() {
            say(&format!("{:names$}  presets: {presets}", ""));
        }
    }
    say("\nThe first preset is the default. `lumivox techniques NAME` lists all settings.");
}

fn describe(entry: &Entry) -> Result<(), CliError> {
    let default = entry
        .settings::<&str>(None, &[])
        .map_err(CliError::failed)?;
    let bounces = match (entry.bounces)(&default) {
        Some(0) => "no indirect bounce",
        Some(1) => "one indirect bounce by default",
        _ => "several indirect bounces by default",
    };
    say(&format!("{}: {} ({bounces})", entry.name, entry.summary));
    for (index, preset) in entry.presets.iter().enumerate() {
        let default = if index == 0 { ", the default" } else { "" };
        let values: Vec<String> = preset
            .values
            .iter()
            .copied()
            .flatten()
            .map(|(name, value)| format!("{name}={value}"))
            .collect();
        say(&format!(
            "  --preset {}{default}: {}{}{}",
            preset.name,
            preset.help,
            if values.is_empty() { "" } else { "; " },
            values.join(" ")
        ));
    }
    for view in entry.views.iter().copied().flatten() {
        say(&format!("  --view {}: {}", view.name, view.help));
    }
    for (group, settings) in entry.groups() {
        if group != Group::Other {
            say(&format!("  {}:", group.name()));
        }
        settings.into_iter().for_each(describe_setting);
    }
    Ok(())
}

fn describe_setting(setting: &Setting) {
    let unit = if setting.unit.is_empty() {
        String::new()
    } else {
        format!(" [{}]", setting.unit)
    };
    say(&format!(
        "  --set {}={}{unit}: {}; {}",
        setting.name, setting.default, setting.help, setting.domain
    ));
}
