//! `lumivox techniques`.

use crate::gi::entry::Entry;
use crate::gi::registry::{all, find};
use crate::gi::settings::{Group, Setting};

use super::CliError;
use super::common::say;

/// List the techniques, their presets and their settings with units, ranges and defaults.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Describe only this technique [default: all of them].
    technique: Option<String>,
}

/// Prints one technique, or all of them.
pub(crate) fn run(args: &Args) -> Result<(), CliError> {
    match &args.technique {
        Some(name) => describe(find(name).map_err(CliError::input)?),
        None => all().into_iter().try_for_each(describe),
    }
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
