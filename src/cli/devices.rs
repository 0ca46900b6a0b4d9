//! `lumivox devices`.

use std::fmt::Write;

use crate::vulkan::{Adapter, Check, Error, Instance, InstanceOptions};

use super::CliError;
use super::common::say;

/// List the Vulkan devices, what each can do, and what is missing where it cannot.
#[derive(clap::Args)]
pub(crate) struct Args {}

/// Prints all devices.
pub(crate) fn run(_args: &Args) -> Result<(), CliError> {
    let instance = Instance::new(&InstanceOptions::default()).map_err(CliError::failed)?;
    let adapters = instance.adapters().map_err(CliError::failed)?;
    if adapters.is_empty() {
        return Err(CliError::failed(Error::NoDevice));
    }
    for adapter in &adapters {
        say(describe(adapter).trim_end());
    }
    Ok(())
}

fn describe(adapter: &Adapter) -> String {
    let (info, limits) = (&adapter.info, &adapter.limits);
    let mut text = String::new();
    let missing = adapter.missing();
    let verdict = if missing.is_empty() {
        "usable".to_owned()
    } else {
        format!("refused, lacks: {}", missing.join(", "))
    };
    // Writing to a string cannot fail.
    let _ = writeln!(
        text,
        "[{}] {} ({}): {verdict}",
        adapter.index, info.name, info.kind
    );
    let _ = writeln!(
        text,
        "    driver {}, Vulkan {}",
        info.driver, info.api_version
    );
    let mib = |bytes: u64| bytes / (1 << 20);
    let _ = writeln!(
        text,
        "    device memory {} MiB, storage buffers to {} MiB, volumes to {}³",
        mib(limits.heap_bytes),
        mib(limits.storage_buffer_bytes),
        limits.extent_3d
    );
    text.push_str("    required\n");
    adapter
        .required
        .iter()
        .for_each(|check| text.push_str(&line(check)));
    text.push_str("    optional\n");
    adapter
        .optional
        .iter()
        .for_each(|check| text.push_str(&line(check)));
    text
}

fn line(check: &Check) -> String {
    if check.present {
        format!("        yes  {}\n", check.name)
    } else {
        format!("        no   {}: {}\n", check.name, check.cost)
    }
}
