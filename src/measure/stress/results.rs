//! Records of failure modes as Markdown, comma-separated values and charts.

use super::{Figure, Figured, Record, StressCase, StressSetup, Verdict};
use crate::gi::settings::RESOLUTION;
use crate::measure::draw::{Chart, LineAxis, LinePanel, Panels, Scale, Series};
use crate::measure::table::csv_of;

/// Figures below this are drawn here.
const LEAST_DRAWN: f64 = 1e-4;

/// One case, and what was measured of it.
pub struct Results<'r> {
    /// The failure mode that was measured.
    pub case: &'static StressCase,
    /// The records of that failure mode.
    pub records: &'r [Record],
}

impl Results<'_> {
    /// A Markdown table for each figure: a row for each technique, preset and change, a column for
    /// each severity.
    pub fn table(&self) -> String {
        let StressCase { help, source, .. } = self.case;
        let mut text = format!("{help} ({source})\n");
        for (index, figure) in self.case.figures.iter().enumerate() {
            text += &format!(
                "\n`{}`: pass up to {}, warn up to {}, else fail\n\n",
                figure.name, figure.pass, figure.warn
            );
            text += &self.figure_table(index);
        }
        for record in self
            .records
            .iter()
            .filter(|record| record.failure.is_some())
        {
            text += &format!(
                "\n- {} at {}: {}",
                record.name(),
                record.severity,
                record.failure.as_deref().unwrap_or_default()
            );
        }
        text + "\n"
    }

    fn figure_table(&self, index: usize) -> String {
        let severities = self.severities();
        let mut text = format!("| {} |", self.case.severity);
        severities
            .iter()
            .for_each(|severity| text += &format!(" {severity} |"));
        text += &format!("\n| --- |{}\n", " --- |".repeat(severities.len()));
        for row in self.rows() {
            text += &format!("| {} |", row[0].name());
            for severity in &severities {
                let cell = row
                    .iter()
                    .find(|record| record.severity == *severity)
                    .map(|record| cell(record, index));
                text += &format!(" {} |", cell.as_deref().unwrap_or("–"));
            }
            text += "\n";
        }
        text
    }

    /// Comma-separated values: a row for each record.
    pub fn csv(&self) -> String {
        let row = |record: &Record| {
            let changes: Vec<String> = record
                .changes
                .iter()
                .map(|(name, value)| format!("{name}={value}"))
                .collect();
            let text = |name: &str, value: &str| (name.to_owned(), value.to_owned());
            let mut row = vec![
                text("case", &record.case),
                text("technique", &record.technique),
                text("preset", record.preset.as_deref().unwrap_or_default()),
                text(
                    "resolution",
                    record.settings.get(RESOLUTION).map_or("", String::as_str),
                ),
                text("changes", &changes.join(" ")),
                text("change", &record.change),
                text("severity", &record.severity.to_string()),
            ];
            row.extend(self.case.figures.iter().enumerate().map(|(index, figure)| {
                let value = record.figures.get(index).and_then(|figure| figure.value);
                (
                    figure.name.to_owned(),
                    value.map(|value| value.to_string()).unwrap_or_default(),
                )
            }));
            row.extend([
                text("verdict", record.verdict().map_or("", Verdict::word)),
                text("failure", record.failure.as_deref().unwrap_or_default()),
                text("effort", &record.setup.effort),
                text("device", &record.setup.device),
                text("build", &record.setup.build),
            ]);
            row
        };
        csv_of(&self.records.iter().map(row).collect::<Vec<_>>())
    }

    /// Figures against severity: one chart of all techniques and presets as they are, and where
    /// settings were changed one of each technique and preset, a line for each change; with the
    /// end of its file's name. A case of one severity has none.
    pub fn charts(&self) -> Vec<(String, Chart)> {
        if self.severities().len() < 2 {
            return Vec::new();
        }
        let rows = self.rows();
        let whole: Vec<_> = rows
            .iter()
            .filter(|row| row[0].change.is_empty())
            .map(|row| (row[0].case_name(), row))
            .collect();
        let mut charts = vec![(String::new(), self.chart(self.case.name.to_owned(), &whole))];
        for (name, first) in whole.iter().map(|(name, row)| (name, row[0])) {
            let of_preset: Vec<_> = rows
                .iter()
                .filter(|row| row[0].case_name() == *name)
                .collect();
            if of_preset.len() > 1 {
                let change = |row: &[&Record]| {
                    if row[0].change.is_empty() {
                        "as it is".to_owned()
                    } else {
                        row[0].change.clone()
                    }
                };
                let lines: Vec<_> = of_preset
                    .into_iter()
                    .map(|row| (change(row), row))
                    .collect();
                charts.push((
                    format!("-{}", first.case_name().replace(' ', "-")),
                    self.chart(format!("{}: {name}", self.case.name), &lines),
                ));
            }
        }
        charts
    }

    fn chart(&self, title: String, lines: &[(String, &Vec<&Record>)]) -> Chart {
        let panel = |(index, figure): (usize, &Figure)| {
            let values = || {
                lines
                    .iter()
                    .flat_map(|(_, row)| row.iter())
                    .filter_map(|record| record.figures.get(index)?.value)
            };
            let is_little = values().any(|value| value <= LEAST_DRAWN);
            let point = |record: &&Record| {
                Some((
                    record.severity,
                    record.figures.get(index)?.value?.max(LEAST_DRAWN),
                ))
            };
            LinePanel {
                y_label: if is_little {
                    format!("{} ({LEAST_DRAWN}: that or less)", figure.name)
                } else {
                    figure.name.to_owned()
                },
                y_scale: Scale::Log,
                series: lines
                    .iter()
                    .map(|(name, row)| Series {
                        name: name.clone(),
                        points: row.iter().filter_map(point).collect(),
                    })
                    .collect(),
                floor: Some(if figure.pass > 0.0 {
                    (figure.pass, format!("passes up to {}", figure.pass))
                } else {
                    (figure.warn, format!("warns up to {}", figure.warn))
                }),
            }
        };
        let records = || lines.iter().flat_map(|(_, row)| row.iter().copied());
        let scene = records()
            .next()
            .and_then(|record| record.scene.as_ref())
            .map(|scene| format!("scene {scene}; "))
            .unwrap_or_default();
        let notes = vec![format!(
            "{scene}{}",
            StressSetup::text(records().map(|record| &record.setup))
        )];
        Chart {
            title,
            notes,
            panels: Panels::Lines(
                LineAxis {
                    label: self.case.severity.to_owned(),
                    ticks: self.case.ticks,
                },
                self.case.figures.iter().enumerate().map(panel).collect(),
            ),
        }
    }

    /// Severities that were measured, in the case's order.
    fn severities(&self) -> Vec<f64> {
        self.case
            .severities
            .iter()
            .copied()
            .filter(|severity| {
                self.records
                    .iter()
                    .any(|record| record.severity == *severity)
            })
            .collect()
    }

    /// Records of one technique, preset and change together, in the order of their first.
    fn rows(&self) -> Vec<Vec<&Record>> {
        let mut rows: Vec<Vec<&Record>> = Vec::new();
        for record in self.records {
            match rows.iter_mut().find(|row| row[0].name() == record.name()) {
                Some(row) => row.push(record),
                None => rows.push(vec![record]),
            }
        }
        rows
    }
}

/// The setup, and all cases in one Markdown table: a row for each case, a column for each technique
/// with an unchanged preset. A cell has the worst verdict, and the severity at which it begins.
pub fn summary(all: &[Results<'_>]) -> String {
    let mut names: Vec<String> = Vec::new();
    for record in all
        .iter()
        .flat_map(|results| results.records)
        .filter(|record| record.change.is_empty())
    {
        if !names.contains(&record.case_name()) {
            names.push(record.case_name());
        }
    }
    let setups = all
        .iter()
        .flat_map(|results| results.records)
        .map(|record| &record.setup);
    let mut text = format!(
        "{}\n\n| case | gets worse with |",
        StressSetup::text(setups)
    );
    names.iter().for_each(|name| text += &format!(" {name} |"));
    text += &format!("\n| --- | --- |{}\n", " --- |".repeat(names.len()));
    for results in all {
        text += &format!("| {} | {} |", results.case.name, results.case.severity);
        for name in &names {
            let own = |record: &&Record| record.change.is_empty() && record.case_name() == *name;
            text += &format!(
                " {} |",
                Worst::of(results.case, results.records.iter().filter(own))
                    .map_or_else(|| "–".to_owned(), |worst| worst.to_string())
            );
        }
        text += "\n";
    }
    text
}

/// How badly one technique with one set of settings fails in one case.
#[derive(Clone, Debug, PartialEq)]
pub struct Worst {
    /// The worst verdict; `None` where nothing could be measured.
    pub verdict: Option<Verdict>,
    /// The severities with this verdict, in the case's order.
    pub severities: Vec<f64>,
    /// Whether all from the first of them on have it.
    pub goes_on: bool,
    /// Whether smaller severities are worse.
    pub falls: bool,
    /// Name of the figure that is furthest beyond what passes at these, and its value, `None`
    /// where it is no finite number; where they go on, at the first.
    pub figure: (String, Option<f64>),
    /// The first severity without any figure.
    pub refused: Option<f64>,
}

impl Worst {
    /// The records of one technique with one set of settings; `None` where there is none.
    pub fn of<'r>(
        case: &StressCase,
        records: impl IntoIterator<Item = &'r Record>,
    ) -> Option<Worst> {
        let falls = case.severities.first() > case.severities.last();
        let mut row: Vec<&Record> = records.into_iter().collect();
        row.sort_by_key(|record| {
            case.severities
                .iter()
                .position(|severity| *severity == record.severity)
        });
        let refused = row
            .iter()
            .find(|record| record.figures.is_empty())
            .map(|record| record.severity);
        let Some(verdict) = row.iter().filter_map(|record| record.verdict()).max() else {
            return refused.map(|severity| Worst {
                verdict: None,
                severities: vec![severity],
                goes_on: false,
                falls,
                figure: (String::new(), None),
                refused,
            });
        };
        row.retain(|record| record.verdict().is_some());
        let bad: Vec<&Record> = row
            .iter()
            .copied()
            .filter(|record| record.verdict() == Some(verdict))
            .collect();
        let goes_on = row.ends_with(&bad);
        let told = if verdict != Verdict::Pass && goes_on {
            &bad[..1]
        } else {
            &bad
        };
        let severities = bad.iter().map(|record| record.severity).collect();
        // If a figure passes only at 0, its own value tells how bad it is.
        let least_pass = |name: &str| {
            case.figures
                .iter()
                .find(|figure| figure.name == name)
                .map_or(
                    1.0,
                    |figure| if figure.pass > 0.0 { figure.pass } else { 1.0 },
                )
        };
        let figures = told
            .iter()
            .flat_map(|record| &record.figures)
            .filter(|figure| figure.verdict == verdict);
        let badness =
            |figure: &Figured| figure.value.unwrap_or(f64::INFINITY) / least_pass(&figure.name);
        let largest = figures.max_by(|a, b| badness(a).total_cmp(&badness(b)))?;
        Some(Worst {
            verdict: Some(verdict),
            severities,
            goes_on,
            falls,
            figure: (largest.name.clone(), largest.value),
            refused,
        })
    }

    /// Where it is so bad, with the unit: "from 0.5 m down" if all that follows is, else "at 0.5, 4
    /// m".
    pub fn place(&self, unit: &str) -> String {
        let texts: Vec<String> = self.severities.iter().copied().map(severity_text).collect();
        let first = texts.first().map_or("", String::as_str);
        let unit = if unit.is_empty() {
            String::new()
        } else {
            format!(" {unit}")
        };
        match (self.goes_on, self.falls) {
            (true, true) => format!("from {first}{unit} down"),
            (true, false) => format!("from {first}{unit} up"),
            (false, _) => format!("at {}{unit}", texts.join(", ")),
        }
    }
}

impl std::fmt::Display for Worst {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self.verdict {
            Some(Verdict::Pass) => write!(f, "{}", Verdict::Pass.word())?,
            Some(verdict) => write!(f, "{} {}", verdict.word(), self.place(""))?,
            None => return write!(f, "no figure {}", self.place("")),
        }
        self.refused.map_or(Ok(()), |severity| {
            write!(f, "; no figure at {}", severity_text(severity))
        })
    }
}

/// A severity as short as it can be written.
pub fn severity_text(severity: f64) -> String {
    if severity.abs() >= 1e6 {
        format!("{severity:e}")
    } else {
        severity.to_string()
    }
}

fn cell(record: &Record, index: usize) -> String {
    match record.figures.get(index) {
        Some(figure) => format!(
            "{} {}",
            figure
                .value
                .map_or_else(|| "∞".to_owned(), |value| format!("{value:.4}")),
            figure.verdict.word()
        ),
        None => "no figure".to_owned(),
    }
}
