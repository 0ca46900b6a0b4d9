//! The report: one JSON object for one run.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde::Serialize;

use crate::gi::Settings;
use crate::gi::settings::Value;
use crate::graph::{Gpu, PassTimes};
use crate::metrics::Comparison;

/// Version of the report's form; a change of meaning raises it.
pub const SCHEMA_VERSION: u32 = 1;

/// Bytes of one resource.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct MemoryRow {
    /// Name of the buffer or image.
    pub name: String,
    /// Bytes that it needs on the device.
    pub bytes: u64,
}

/// One run.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// [`SCHEMA_VERSION`].
    pub schema_version: u32,
    /// Version of the program.
    pub version: &'static str,
    /// Commit that the program was built from, where it is known.
    pub commit: Option<&'static str>,
    /// Device.
    pub device: String,
    /// Driver and its version.
    pub driver: String,
    /// Scene.
    pub scene: String,
    /// Width and height (px).
    pub size: [u32; 2],
    /// Technique.
    pub technique: &'static str,
    /// All its settings.
    pub settings: BTreeMap<&'static str, Value>,
    /// Building the static structure: GPU time of each pass.
    pub build: Vec<PassTimes>,
    /// Each pass of a frame, in order.
    pub passes: Vec<PassTimes>,
    /// Every buffer and image on the device, in order of creation; those of one name are summed.
    pub memory: Vec<MemoryRow>,
    /// Their sum, as the allocator counts it.
    pub memory_bytes: u64,
    /// Counts, by name.
    pub counts: BTreeMap<&'static str, u64>,
    /// Error against a reference, where there was one.
    pub error: Option<Comparison>,
}

/// A report that could not be written.
#[derive(Debug, thiserror::Error)]
#[error("cannot write the report {}: {source}; check that the folder exists, is writable and has space", path.display())]
pub struct ReportError {
    path: PathBuf,
    source: std::io::Error,
}

/// Memory in use, by name; the last row is what the allocator spends on alignment, so that the sum is the allocator's own.
pub fn memory_rows(gpu: &Gpu) -> Vec<MemoryRow> {
    let mut rows: Vec<MemoryRow> = Vec::new();
    for (name, bytes) in gpu.memory() {
        match rows.iter_mut().find(|row| row.name == name) {
            Some(row) => row.bytes += bytes,
            None => rows.push(MemoryRow { name, bytes }),
        }
    }
    let known: u64 = rows.iter().map(|row| row.bytes).sum();
    match gpu.memory_total().saturating_sub(known) {
        0 => {}
        bytes => rows.push(MemoryRow { name: "allocator.alignment".into(), bytes }),
    }
    rows
}

impl Report {
    /// A report without times, counts and error.
    pub fn new(gpu: &Gpu, scene: &str, size: [u32; 2], technique: &'static str, settings: &Settings) -> Self {
        let info = gpu.info();
        let memory = memory_rows(gpu);
        Report {
            schema_version: SCHEMA_VERSION,
            version: env!("CARGO_PKG_VERSION"),
            commit: option_env!("LUMIVOX_COMMIT"),
            device: info.name.clone(),
            driver: info.driver.clone(),
            scene: scene.to_owned(),
            size,
            technique,
            settings: settings.iter().collect(),
            build: Vec::new(),
            passes: Vec::new(),
            memory_bytes: gpu.memory_total(),
            memory,
            counts: BTreeMap::new(),
            error: None,
        }
    }

    /// Writes it as JSON.
    pub fn write(&self, path: &Path) -> Result<(), ReportError> {
        let text = serde_json::to_string_pretty(self).map_err(std::io::Error::other);
        text.and_then(|text| std::fs::write(path, text + "\n")).map_err(|source| ReportError { path: path.to_owned(), source })
    }
}
