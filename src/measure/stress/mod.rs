//! Failure modes: a parameter that runs from harmless to fatal, and a figure that tells how bad it is, for each technique and each setting that matters.

mod thin_walls;

use std::collections::BTreeMap;

use serde::Serialize;

use super::bench::Case;
use super::chart::{Chart, LinePanel, Panels, Scale, Series};
use super::table::value_text;
use crate::frame::FrameSettings;
use crate::gi::registry::Entry;
use crate::gi::settings::{Domain, SettingError, Value};
use crate::gi::{Settings, settings::Setting};
use crate::graph::{Error, Gpu};
use crate::metrics::MetricError;
use crate::reference::ReferenceError;
use crate::scene::SceneError;

/// All failure modes.
pub static CASES: &[&StressCase] = &[&thin_walls::CASE];

/// One failure mode.
pub struct StressCase {
    /// Its name.
    pub name: &'static str,
    /// What goes wrong, in one line.
    pub help: &'static str,
    /// Who names the failure.
    pub source: &'static str,
    /// What gets worse, with its unit.
    pub severity: &'static str,
    /// How bad it is made, harmless first.
    pub severities: &'static [f64],
    /// What is measured; 0 is ideal.
    pub figure: &'static str,
    /// Up to this figure it passes.
    pub pass: f64,
    /// Up to this figure it is a warning; beyond it fails.
    pub warn: f64,
    /// Settings whose effect is measured, where a technique has them.
    pub changes: &'static [Change],
    /// Measures the figure.
    pub measure: fn(&Probe<'_>, f64) -> Result<f64, StressError>,
}

/// A setting that matters to a failure mode.
pub struct Change {
    /// Its name.
    pub name: &'static str,
    /// Values to try; none stand for all words that it takes.
    pub values: &'static [&'static str],
    /// A setting and the value that it has to have (where the technique has it) for this one to do anything.
    pub needs: Option<(&'static str, &'static str)>,
}

/// What is measured.
pub struct Probe<'p> {
    /// The device.
    pub gpu: &'p Gpu,
    /// The technique.
    pub entry: &'static Entry,
    /// Its settings.
    pub settings: &'p Settings,
    /// What all techniques share.
    pub frame: FrameSettings,
}

/// Why there is no figure.
#[derive(Debug, thiserror::Error)]
pub enum StressError {
    /// The technique cannot be rendered.
    #[error(transparent)]
    Gpu(#[from] Error),
    /// The scene cannot be made.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// The scene cannot be traced.
    #[error(transparent)]
    Reference(#[from] ReferenceError),
    /// There is nothing to compare.
    #[error(transparent)]
    Metric(#[from] MetricError),
}

/// How a figure is judged.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Verdict {
    /// Good enough.
    Pass,
    /// Visible.
    Warn,
    /// Broken.
    Fail,
}

/// One figure.
#[derive(Clone, Debug, Serialize)]
pub struct Record {
    /// Version of the program.
    pub version: &'static str,
    /// Commit that the program was built from, where it is known.
    pub commit: Option<&'static str>,
    /// Device.
    pub device: String,
    /// Driver and its version.
    pub driver: String,
    /// Failure mode.
    pub case: &'static str,
    /// Technique.
    pub technique: &'static str,
    /// Preset that the settings started from.
    pub preset: Option<String>,
    /// The setting that was changed, `KEY=VALUE`; empty for none.
    pub change: String,
    /// All settings.
    pub settings: BTreeMap<&'static str, Value>,
    /// Width and height of a picture (px).
    pub size: [u32; 2],
    /// How bad it was made.
    pub severity: f64,
    /// The figure, and what it is.
    pub figure: Option<f64>,
    /// Its verdict.
    pub verdict: Option<Verdict>,
    /// Why there is no figure.
    pub failure: Option<String>,
}

impl StressCase {
    /// How a figure is judged; what is not a number fails.
    pub fn verdict(&self, figure: f64) -> Verdict {
        if figure <= self.pass {
            Verdict::Pass
        } else if figure <= self.warn {
            Verdict::Warn
        } else {
            Verdict::Fail
        }
    }

    /// The settings as they are, with the change that is none, and then with one change each.
    pub fn variants(&self, entry: &Entry, settings: &Settings) -> Result<Vec<(String, Settings)>, SettingError> {
        let old: Vec<String> = settings.iter().map(|(name, value)| format!("{name}={}", value_text(&value))).collect();
        let is_met = |(name, wanted): &(&str, &str)| settings.iter().all(|(key, value)| key != *name || value_text(&value) == *wanted);
        let mut variants = vec![(String::new(), settings.clone())];
        for change in self.changes.iter().filter(|change| change.needs.as_ref().is_none_or(is_met)) {
            let Some(setting) = entry.settings.iter().copied().flatten().find(|setting| setting.name == change.name) else { continue };
            for value in values(change, setting) {
                let pair = format!("{}={value}", change.name);
                let new = entry.settings(None, &old.iter().chain([&pair]).cloned().collect::<Vec<_>>())?;
                if new != *settings {
                    variants.push((pair, new));
                }
            }
        }
        Ok(variants)
    }

    /// Measures one technique with one variant of its settings at one severity. What the device refuses is told in the record.
    pub fn record(&self, gpu: &Gpu, case: &Case, variant: &(String, Settings), frame: FrameSettings, severity: f64) -> Result<Record, StressError> {
        let (change, settings) = variant;
        let (figure, failure) = match (self.measure)(&Probe { gpu, entry: case.entry, settings, frame }, severity) {
            Ok(figure) => (Some(figure), None),
            Err(StressError::Gpu(failure)) => (None, Some(failure.to_string())),
            Err(other) => return Err(other),
        };
        Ok(Record {
            version: env!("CARGO_PKG_VERSION"),
            commit: option_env!("LUMIVOX_COMMIT"),
            device: gpu.info().name.clone(),
            driver: gpu.info().driver.clone(),
            case: self.name,
            technique: case.entry.name,
            preset: case.preset.clone(),
            change: change.clone(),
            settings: settings.iter().collect(),
            size: frame.size,
            severity,
            figure,
            verdict: figure.map(|figure| self.verdict(figure)),
            failure,
        })
    }

    /// The figures as a Markdown table: a row for each technique, preset and change, a column for each severity.
    pub fn table(&self, records: &[Record]) -> String {
        let StressCase { help, source, severity, severities, figure, pass, warn, .. } = self;
        let mut text = format!("{help} ({source})\n\n`{figure}`: pass up to {pass}, warn up to {warn}, else fail\n\n| {severity} |");
        severities.iter().for_each(|severity| text += &format!(" {severity} |"));
        text += &format!("\n| --- |{}\n", " --- |".repeat(severities.len()));
        for row in rows(records) {
            text += &format!("| {} |", row[0].name());
            for severity in *severities {
                text += &row.iter().find(|record| record.severity == *severity).map_or_else(|| " – |".to_owned(), |record| format!(" {} |", record.cell()));
            }
            text += "\n";
        }
        text
    }

    /// The figures as comma-separated values, a row each.
    pub fn csv(&self, records: &[Record]) -> String {
        let line = |record: &Record| {
            let Record { case, technique, change, severity, .. } = record;
            let preset = record.preset.as_deref().unwrap_or_default();
            let figure = record.figure.map(|figure| figure.to_string()).unwrap_or_default();
            let verdict = record.verdict.map(Verdict::word).unwrap_or_default();
            format!("{case},{technique},{preset},{change},{severity},{figure},{verdict}\n")
        };
        format!("case,technique,preset,change,{},{},verdict\n", self.severity, self.figure) + &records.iter().map(line).collect::<String>()
    }

    /// Figure against severity, a line for each change: of each technique and preset one chart, with its name.
    pub fn charts(&self, records: &[Record]) -> Vec<(String, Chart)> {
        let mut charts: Vec<(String, Chart)> = Vec::new();
        for row in rows(records) {
            let first = row[0];
            let points = row.iter().filter_map(|record| Some((record.severity, record.figure?.max(LEAST_DRAWN)))).collect();
            let series = Series { name: if first.change.is_empty() { "as it is".into() } else { first.change.clone() }, points };
            let name = first.case_name().replace(' ', "-");
            match charts.iter_mut().find(|(known, _)| *known == name) {
                Some((_, Chart { panels: Panels::Lines(_, panels), .. })) => panels[0].series.push(series),
                _ => charts.push((name, self.chart(first, series))),
            }
        }
        charts
    }

    fn chart(&self, first: &Record, series: Series) -> Chart {
        let commit = first.commit.map(|commit| format!(" ({commit})")).unwrap_or_default();
        let [width, height] = first.size;
        let panel = LinePanel {
            y_label: format!("{} ({LEAST_DRAWN}: that or less)", self.figure),
            y_scale: Scale::Log,
            series: vec![series],
            floor: Some((self.pass, "passes".into())),
        };
        Chart {
            title: format!("{}: {}", self.name, first.case_name()),
            notes: vec![format!("{}, {}; lumivox {}{commit}; {width}x{height} px", first.device, first.driver, first.version)],
            panels: Panels::Lines(self.severity.to_owned(), vec![panel]),
        }
    }
}

/// Figures below this are drawn here.
const LEAST_DRAWN: f64 = 1e-4;

fn values(change: &Change, setting: &Setting) -> Vec<&'static str> {
    match setting.domain {
        Domain::Choice(words) if change.values.is_empty() => words.to_vec(),
        _ => change.values.to_vec(),
    }
}

/// Records of one technique, preset and change together, in the order of their first.
fn rows(records: &[Record]) -> Vec<Vec<&Record>> {
    let mut rows: Vec<Vec<&Record>> = Vec::new();
    for record in records {
        match rows.iter_mut().find(|row| row[0].name() == record.name()) {
            Some(row) => row.push(record),
            None => rows.push(vec![record]),
        }
    }
    rows
}

impl Verdict {
    fn word(self) -> &'static str {
        match self {
            Verdict::Pass => "pass",
            Verdict::Warn => "warn",
            Verdict::Fail => "fail",
        }
    }
}

impl Record {
    /// Technique and preset.
    pub fn case_name(&self) -> String {
        self.preset.as_ref().map_or_else(|| self.technique.to_owned(), |preset| format!("{} {preset}", self.technique))
    }

    fn name(&self) -> String {
        if self.change.is_empty() { self.case_name() } else { format!("{}, `{}`", self.case_name(), self.change) }
    }

    fn cell(&self) -> String {
        match (self.figure, self.verdict) {
            (Some(figure), Some(verdict)) => format!("{figure:.4} {}", verdict.word()),
            _ => self.failure.clone().unwrap_or_default(),
        }
    }
}
