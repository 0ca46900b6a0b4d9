//! What `lumivox stress` found of the settings that a page recommends.

use std::path::{Path, PathBuf};

use super::point::Point;
use super::records::{RecordError, read_records};
use crate::measure::stress::results::Worst;
use crate::measure::stress::{CASES, LEAST_RESOLUTION, Record, StressCase};

/// Results of `lumivox stress`, and where they are.
#[derive(Clone, Debug, Default)]
pub struct Troubles {
    /// The folder, as commands are to name it.
    pub folder: PathBuf,
    records: Vec<Record>,
}

/// One technique with one set of settings in all failure modes that were measured of it.
#[derive(Clone, Debug)]
pub struct TroubleRun<'t> {
    /// Its records; all have technique, settings, device, sizes and effort of the first.
    pub records: Vec<&'t Record>,
}

/// One failure mode, and how one technique fares in it.
#[derive(Clone)]
pub struct Finding {
    /// The failure mode.
    pub case: &'static StressCase,
    /// How badly it fails.
    pub worst: Worst,
}

impl Troubles {
    /// All records (`*.jsonl`) of a folder and of the folders in it, which are those of scenes. A folder that is not there has none.
    pub fn read(folder: &Path) -> Result<Self, RecordError> {
        let mut records = Vec::new();
        if folder.is_dir() {
            let (files, folders) = list(folder)?;
            let inner = folders.iter().map(|folder| Ok(list(folder)?.0)).collect::<Result<Vec<_>, RecordError>>()?;
            for file in files.into_iter().chain(inner.into_iter().flatten()) {
                records.extend(read_records::<Record>(&file)?);
            }
        }
        Ok(Troubles { folder: folder.to_owned(), records })
    }

    /// Whether there is nothing.
    pub fn is_empty(&self) -> bool {
        self.records.is_empty()
    }

    /// The run that is closest to a point: its own technique and settings, at any resolution as severities count in voxels; or else its preset's with other
    /// settings. Of equally close ones that of the point's device, the most thorough, the one with the most failure modes, the last.
    pub fn run_of(&self, point: &Point) -> Option<TroubleRun<'_>> {
        let mut runs: Vec<TroubleRun<'_>> = Vec::new();
        let fits = |record: &&Record| {
            record.change.is_empty() && record.technique == point.technique && record.scene.as_ref().is_none_or(|scene| *scene == point.scene)
        };
        for record in self.records.iter().filter(fits) {
            match runs.iter_mut().find(|run| run.is_of(record)) {
                Some(run) => run.add(record),
                None => runs.push(TroubleRun { records: vec![record] }),
            }
        }
        runs.retain(|run| run.differences(point).is_empty() || run.records[0].preset == point.preset);
        let distance = |run: &TroubleRun<'_>| {
            let (record, resolution) = (run.records[0], run.records[0].settings.get("resolution").map(String::as_str));
            let is_other_device = record.setup.device != point.setup.device;
            let unmeasured = usize::MAX - run.findings().len();
            (run.differences(point).len(), is_other_device, record.setup.effort != "full", resolution != point.resolution(), unmeasured)
        };
        runs.into_iter().rev().min_by_key(distance)
    }

    /// The command that measures a point's own settings.
    pub fn command(&self, point: &Point) -> String {
        let resolution = point.resolution().and_then(|resolution| resolution.parse::<u32>().ok()).map(|resolution| resolution.max(LEAST_RESOLUTION));
        let preset = point.preset.iter().flat_map(|preset| ["--preset".to_owned(), preset.clone()]);
        let resolution = resolution.iter().flat_map(|resolution| ["--resolution".to_owned(), resolution.to_string()]);
        let changes = point.changes.iter().flat_map(|(name, value)| ["--set".to_owned(), format!("{name}={value}")]);
        let head = ["lumivox", "stress", "--technique", &point.technique].map(str::to_owned).into_iter();
        let words: Vec<String> = head.chain(preset).chain(resolution).chain(changes).collect();
        format!("{} -o {}", words.join(" "), super::page::quoted(&self.folder.display().to_string()))
    }
}

impl<'t> TroubleRun<'t> {
    /// Adds a record in place of an older one of the same, such as that of another build.
    fn add(&mut self, record: &'t Record) {
        let what = |record: &Record| (record.case.clone(), record.scene.clone(), record.severity.to_bits());
        self.records.retain(|known| what(known) != what(record));
        self.records.push(record);
    }

    fn is_of(&self, record: &Record) -> bool {
        let first = self.records[0];
        let setup = |record: &Record| (record.setup.device.clone(), record.setup.size, record.setup.shadow_resolution, record.setup.effort.clone());
        first.settings == record.settings && first.preset == record.preset && setup(first) == setup(record)
    }

    /// The settings but `resolution` that the point has otherwise, as the run had them.
    pub fn differences(&self, point: &Point) -> Vec<String> {
        let differs = |(name, value): &(&String, &String)| *name != "resolution" && point.settings.get(*name) != Some(*value);
        self.records[0].settings.iter().filter(differs).map(|(name, value)| format!("{name}={value}")).collect()
    }

    /// Technique, preset, resolution and effort.
    pub fn name(&self) -> String {
        let Record { setup, settings, .. } = self.records[0];
        let resolution = settings.get("resolution").map(|resolution| format!(" {resolution}³")).unwrap_or_default();
        let effort = if setup.effort == "full" { String::new() } else { format!(" ({})", setup.effort) };
        format!("{}{resolution}{effort}", self.records[0].case_name())
    }

    /// Failure mode by failure mode, in their order.
    pub fn findings(&self) -> Vec<Finding> {
        let finding = |case: &&'static StressCase| {
            let of_case = || self.records.iter().copied().filter(|record| record.case == case.name);
            // What was measured on the point's own scene says more than the suite's scene.
            let has_own = of_case().any(|record| record.scene.is_some());
            let worst = Worst::of(case, of_case().filter(|record| record.scene.is_some() == has_own))?;
            Some(Finding { case, worst })
        };
        CASES.iter().filter_map(finding).collect()
    }
}

/// Files of records and folders in a folder, sorted.
fn list(folder: &Path) -> Result<(Vec<PathBuf>, Vec<PathBuf>), RecordError> {
    let failed = |source| RecordError::File { what: "read the folder", path: folder.to_owned(), source };
    let entries = std::fs::read_dir(folder).map_err(failed)?;
    let mut paths: Vec<PathBuf> = entries.map(|entry| entry.map(|entry| entry.path())).collect::<Result<_, _>>().map_err(failed)?;
    paths.sort();
    let folders = paths.iter().filter(|path| path.is_dir()).cloned().collect();
    paths.retain(|path| path.is_file() && path.extension().is_some_and(|extension| extension == "jsonl"));
    Ok((paths, folders))
}
